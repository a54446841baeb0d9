"""One machine of a fleet."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from .. import _stillbeam
from ..model import Model
from ..recording import Recording


@dataclass(frozen=True)
class Machine:
    """A machine, its recordings, and for a diagnosis its model.

    Files must be where the workers can read them; recordings and models in memory travel to them.
    """

    name: str
    """Another one for every machine of a fleet."""
    recordings: Iterable[Recording | str | os.PathLike[str]]
    held_out: Iterable[Recording | str | os.PathLike[str]] = ()
    """To judge on, of a diagnosis."""
    model: Model | str | os.PathLike[str] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "recordings", tuple(self.recordings))
        object.__setattr__(self, "held_out", tuple(self.held_out))

    def key(self, task: str, options: Mapping[str, Any]) -> str:
        """What its result depends on, as one word: the task, the options, the build of stillbeam, and every
        input, files by their size and time of change."""
        asked = json.dumps([task, dict(options), _build()], sort_keys=True, default=repr)
        digest = hashlib.sha256(asked.encode())
        for given in (*self.recordings, None, *self.held_out, None, self.model):
            _add(digest, given)
        return digest.hexdigest()[:32]


@cache
def _build() -> str:
    """Which build of stillbeam this is: another one may find something else."""
    return hashlib.sha256(Path(_stillbeam.__file__).read_bytes()).hexdigest()


def _add(digest: Any, given: Any) -> None:
    if given is None:
        digest.update(b"\0none")
    elif isinstance(given, Recording):
        for column, samples in (("time_s", given.time_s), *given.columns.items()):
            digest.update(f"\0{column}\0".encode())
            digest.update(samples.tobytes())
        digest.update(repr(given.role).encode())
    elif isinstance(given, Model):
        digest.update(f"\0{given.text}".encode())
    else:
        path = Path(given)
        digest.update(f"\0{path}".encode())
        # A file that is not there is the worker's to name.
        if path.exists():
            state = path.stat()
            digest.update(f"\0{state.st_size}\0{state.st_mtime_ns}".encode())
