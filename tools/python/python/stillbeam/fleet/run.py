"""Spreading the work."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .journal import Entry, Journal
from .machine import Machine
from .survey import Survey
from .work import work

if TYPE_CHECKING:
    from distributed import Client

Told = Callable[[int, int], object]


def identify(
    machines: Iterable[Machine],
    out: str | os.PathLike[str],
    *,
    client: Client | None = None,
    told: Told | None = None,
    **options: Any,
) -> Survey:
    """The modes of every machine.

    Parameters
    ----------
    machines
        With a name of their own each.
    out
        The folder for ``journal.jsonl`` (what is done), ``table.parquet`` and ``page.html``. A run with the
        same folder goes on where the last one was.
    client
        Of a Dask cluster; by default one worker for every processor of this computer.
    told
        Called with how many machines are done, and of how many, after each.
    **options
        Of :func:`stillbeam.identify`, the same for all machines.

    Returns
    -------
    Survey
        What was found. A machine that failed is in it with the reason, and is tried again by the next run.
    """
    return _run("identify", machines, out, client, told, options)


def diagnose(
    machines: Iterable[Machine],
    out: str | os.PathLike[str],
    *,
    client: Client | None = None,
    told: Told | None = None,
    **options: Any,
) -> Survey:
    """Which physics the model of every machine left out; as :func:`identify`, with the options of
    :func:`stillbeam.diagnose`."""
    return _run("diagnose", machines, out, client, told, options)


def _run(
    task: str,
    machines: Iterable[Machine],
    out: str | os.PathLike[str],
    client: Client | None,
    told: Told | None,
    options: Mapping[str, Any],
) -> Survey:
    machines = list(machines)
    twice = [name for name, count in Counter(machine.name for machine in machines).items() if count > 1]
    if twice:
        raise ValueError(f"several machines are called {', '.join(sorted(twice))}; give each a name of its own")
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    journal = Journal(folder / "journal.jsonl")
    keys = {machine.name: machine.key(task, options) for machine in machines}
    open_ones = [machine for machine in machines if not journal.is_done(machine.name, keys[machine.name])]
    done = len(machines) - len(open_ones)
    if open_ones:
        with _cluster(client) as workers:
            for entry in _results(workers, task, open_ones, keys, options):
                journal.add(entry)
                done += 1
                if told is not None:
                    told(done, len(machines))
    survey = Survey.of([entry for machine in machines if (entry := journal.entry(machine.name)) is not None])
    survey.save(folder)
    return survey


def _results(
    client: Client,
    task: str,
    machines: list[Machine],
    keys: Mapping[str, str],
    options: Mapping[str, Any],
) -> Iterable[Any]:
    """As they come. A worker that dies loses what it was doing, and the cluster does that again. After several
    deaths it gives up all machines that were with those workers; these are tried again one by one, which tells
    the machine that no worker survives from the others."""
    from distributed import as_completed
    from distributed.scheduler import KilledWorker

    def submit(machine: Machine) -> Any:
        return client.submit(work, task, machine, keys[machine.name], options, pure=False)

    futures = {submit(machine): machine for machine in machines}
    suspects = []
    for future in as_completed(list(futures)):
        try:
            yield future.result()
        except KilledWorker:
            suspects.append(futures[future])
        future.release()
    for machine in suspects:
        try:
            yield submit(machine).result()
        except KilledWorker:
            why = "every worker that had it died, for want of memory perhaps"
            yield Entry(machine.name, keys[machine.name], 0.0, why, [])


@contextmanager
def _cluster(client: Client | None) -> Iterable[Client]:
    if client is not None:
        yield client
        return
    try:
        import dask
        from distributed import Client, LocalCluster
    except ImportError as missing:
        raise ImportError("fleets need Dask: pip install 'stillbeam[fleet]'") from missing
    # One machine on one processor: workers that share processors among the parts of one fit wait for each other.
    alone = {"distributed.nanny.environ.RAYON_NUM_THREADS": "1"}
    with (
        dask.config.set(alone),
        LocalCluster(n_workers=os.cpu_count(), threads_per_worker=1, dashboard_address=":0") as cluster,
        Client(cluster) as own,
    ):
        yield own
