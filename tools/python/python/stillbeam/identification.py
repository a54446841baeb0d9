"""Modes from recordings."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _stillbeam
from .display import html_list, html_table, pyplot, with_error
from .recording import Recording, as_list, reading_options

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Estimate(float):
    """A number that carries its standard error, in the same unit; it computes as the number."""

    stderr: float
    """Of the estimate; NaN where there is none."""

    def __new__(cls, value: float, stderr: float) -> Estimate:
        estimate = super().__new__(cls, value)
        estimate.stderr = float(stderr)
        return estimate

    def __getnewargs__(self) -> tuple[float, float]:
        return float(self), self.stderr

    @property
    def value(self) -> float:
        """The number."""
        return float(self)

    def __str__(self) -> str:
        return with_error(float(self), self.stderr)

    def __repr__(self) -> str:
        return f"Estimate({float(self)!r}, {self.stderr!r})"

    @classmethod
    def _of(cls, filed: dict[str, Any]) -> Estimate:
        number = lambda given: float("nan") if given is None else float(given)  # noqa: E731
        return cls(number(filed["value"]), number(filed["stderr"]))


@dataclass(frozen=True)
class Mode:
    """A mode of vibration."""

    frequency_hz: Estimate
    """Undamped natural frequency, Hz."""
    damping_ratio: Estimate
    """Damping ratio, 1 is critical."""
    amplitude: Estimate
    """How large it is in the recording, in the output's unit."""
    method: str
    """How it was found."""
    frequency_box_hz: tuple[float, float]
    """Where the frequency may be: two standard errors either way, and what depends on amplitude."""
    damping_box: tuple[float, float]
    """The same of the damping ratio."""
    _place: tuple[str, int] = field(repr=False, compare=False)
    """The file of modes that it is in, and its number there, from 1."""

    @classmethod
    def _of(cls, filed: dict[str, Any], modes_file: str, number: int) -> Mode:
        area = filed["uncertainty_box"]
        return cls(
            Estimate._of(filed["frequency_hz"]),
            Estimate._of(filed["damping_ratio"]),
            Estimate._of(filed["amplitude"]),
            filed["method"],
            tuple(area["frequency_hz"]),
            tuple(area["damping_ratio"]),
            (modes_file, number),
        )


@dataclass(frozen=True, eq=False, repr=False)
class Fit:
    """The fitted output of one recording beside the recorded one."""

    time_s: np.ndarray
    """Stamps of what was fitted, shape (n,)."""
    measured: np.ndarray
    """The recorded output there, shape (n,), in its unit; empty for a record that is read in another way than
    sample by sample."""
    fitted: np.ndarray
    """The fitted output there."""


@dataclass(frozen=True, eq=False)
class Identification(Sequence["Mode"]):
    """The modes of recordings, by rising frequency: ``found[0].frequency_hz``."""

    modes: tuple[Mode, ...]
    """One set for all recordings."""
    output: str
    """The column that was fitted, of the first recording."""
    input: str | None
    """The column that drives, if there is one."""
    kind: str | None
    """What kind of record it is, where no input was given."""
    fit: Fit
    """Of the first recording."""
    fit_percent: float | None
    """How much of the output the fit explains."""
    warnings: tuple[str, ...]
    """What to know before relying on the modes."""
    remarks: tuple[str, ...]
    """What was said on the way."""
    results: tuple[dict[str, Any], ...]
    """Everything that `stillbeam identify --json` writes, of all recordings together first where they were
    fitted together, then of each."""
    _modes_file: str

    def __getitem__(self, index: Any) -> Any:
        return self.modes[index]

    def __len__(self) -> int:
        return len(self.modes)

    def __iter__(self) -> Iterator[Mode]:
        return iter(self.modes)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the file of modes that ``stillbeam shape --modes-from`` and :func:`stillbeam.shape` read."""
        with open(path, "w", encoding="utf-8") as file:
            file.write(self._modes_file)

    @property
    def frf(self) -> dict[str, np.ndarray] | None:
        """The frequency response of a forced record: ``frequency_hz`` and complex ``response``, both of shape
        (m,)."""
        filed = self.results[0].get("frf")
        if not filed:
            return None
        response = np.asarray(filed["real"]) + 1j * np.asarray(filed["imag"])
        return {"frequency_hz": np.asarray(filed["frequency_hz"], dtype=float), "response": response}

    def plot(self) -> Figure:
        """The recorded and the fitted output, and what is left."""
        plt = pyplot()
        figure, (above, below) = plt.subplots(2, 1, sharex=True, figsize=(8, 5), height_ratios=(2, 1))
        above.plot(self.fit.time_s, self.fit.measured, linewidth=0.8, label="recorded")
        above.plot(self.fit.time_s, self.fit.fitted, linewidth=0.8, label="fitted")
        above.set_ylabel(self.output)
        above.legend(loc="upper right")
        below.plot(self.fit.time_s, self.fit.measured - self.fit.fitted, linewidth=0.6)
        below.set_ylabel("recorded - fitted")
        below.set_xlabel("time (s)")
        named = ", ".join(f"{mode.frequency_hz.value:.4g} Hz" for mode in self.modes)
        figure.suptitle(f"Modes: {named}" if named else "No modes")
        return figure

    def _repr_html_(self) -> str:
        rows = [
            (number, mode.frequency_hz, mode.damping_ratio, mode.amplitude)
            for number, mode in enumerate(self.modes, 1)
        ]
        fit = "" if self.fit_percent is None else f"; the fit explains {self.fit_percent:.1f} %"
        table = html_table(
            f"Modes of {self.output}{fit}", ("mode", "frequency (Hz)", "damping ratio", "amplitude"), rows
        )
        return table + html_list(self.warnings)

    def __repr__(self) -> str:
        named = "; ".join(f"{mode.frequency_hz} Hz, {mode.damping_ratio}" for mode in self.modes)
        return f"Identification({named or 'no modes'})"


def identify(
    recordings: Recording | str | os.PathLike[str] | Iterable[Recording | str | os.PathLike[str]],
    *,
    input: str | None = None,
    output: str | Iterable[str] | None = None,
    modes: int | None = None,
    sweep: str | None = None,
    input_kind: str | None = None,
    output_quantity: str | None = None,
    keep_input: bool = False,
    max_delay_s: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
    **reading: Any,
) -> Identification:
    """Natural frequencies and damping ratios, with standard errors, from recordings.

    With an input the record is a forced one. Without, the record says itself what it is: a free decay is
    fitted, of a random record the outputs alone are read, a sweep or a tone is refused with what it needs.
    Several forced recordings are also fitted together.

    Parameters
    ----------
    recordings
        One or several of the same structure; files are read as :func:`stillbeam.read` does, and may also be
        frequency response functions.
    input
        The column that drives the structure.
    output
        The column that responds; by default the tip's, else the strongest. Several give mode shapes.
    modes
        How many; by default all that stand out.
    sweep
        The sweep that was not recorded: ``"FROM,TO,RATE_OR_SECONDS[,exponential]"``, such as
        ``"5,133.33,1Hz/s"``.
    input_kind
        ``"force"``, ``"base_position"`` or ``"base_acceleration"``, where the unit does not say.
    output_quantity
        ``"position"``, ``"velocity"`` or ``"acceleration"``, where the unit does not say.
    keep_input
        Take the input as given even where the base's position was recorded.
    max_delay_s
        The longest delay of the output behind the input that may be found, seconds.
    start_s, end_s
        Where the free decay begins and ends, seconds.
    **reading
        How files are read, as in :func:`stillbeam.read`.

    Raises
    ------
    InputError
        A file, a column, or a record that determines no modes.
    """
    given_recordings = as_list(recordings)
    if not given_recordings:
        raise _stillbeam.InputError("there is no recording; give at least one")
    if reading and all(isinstance(given, Recording) for given in given_recordings):
        raise TypeError(f"identify() has no option {', '.join(sorted(reading))} for recordings in memory; see help(identify)")
    measured = [given._parts() if isinstance(given, Recording) else os.fspath(given) for given in given_recordings]
    choices = {
        "input": input,
        "output": output if output is None or isinstance(output, str) else ",".join(output),
        "sweep": sweep,
        "input_kind": input_kind,
        "output_quantity": output_quantity,
        "keep_input": keep_input,
        "max_delay_s": max_delay_s,
        "start_s": start_s,
        "end_s": end_s,
        "modes": modes,
    }
    options = reading_options(**reading)
    modes_file, results, fits, remarks = _stillbeam.identify(measured, choices, options)
    filed, results = json.loads(modes_file), json.loads(results)
    first = results[0]
    warnings = [warning["message"] for warning in filed.get("warnings", [])]
    if len(results) > 1 and not filed["modes"]:
        warnings.append("no mode is common to all recordings; `results` has those of each")
    percent = [record.get("fit_percent") for record in first.get("records", [])]
    return Identification(
        modes=tuple(Mode._of(mode, modes_file, number) for number, mode in enumerate(filed["modes"], 1)),
        output=first["output"],
        input=first["input"],
        kind=first.get("kind"),
        fit=Fit(*fits[0]),
        fit_percent=percent[0] if percent else None,
        warnings=tuple(warnings),
        remarks=tuple(line for line in remarks if not line.startswith("warning: ")),
        results=tuple(results),
        _modes_file=modes_file,
    )
