"""Input shapers."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _stillbeam
from .display import html_list, html_table, pyplot
from .identification import Identification

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Stage:
    """One stage of the shaper, as the board runs it: integer taps."""

    frequency_hz: float | None
    """The mode that it is for, Hz; none of a stage for all modes."""
    damping_ratio: float | None
    type: str
    delay_ticks: np.ndarray
    """Of the taps, shape (taps,)."""
    weight: np.ndarray
    """Of the taps, shape (taps,); they sum to ``weight_one``."""
    weight_one: int


@dataclass(frozen=True)
class Shaper:
    """A shaper: impulses that a command is convolved with so that the machine does not ring."""

    rate_hz: float
    """Ticks per second."""
    duration_s: float
    """From the first impulse to the last, seconds: how much longer a move takes."""
    delay_s: float
    """Of the impulses' centre, seconds: how much later the machine is."""
    time_s: np.ndarray
    """Of the impulses, shape (impulses,)."""
    amplitude: np.ndarray
    """Of the impulses, shape (impulses,); they sum to 1."""
    stages: tuple[Stage, ...]
    """The cascade that the board runs."""
    residual: np.ndarray
    """Vibration left of each mode, a fraction of the unshaped command's, shape (modes,)."""
    residual_over_box: np.ndarray
    """The most that is left of each mode anywhere in its box, shape (modes,)."""
    crc32: str
    """What the board says of the table."""
    remarks: tuple[str, ...]
    """What was said on the way."""
    _table: str

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Shaper:
        """Reads a table that ``stillbeam shape --json`` or :meth:`save` wrote."""
        return cls._of(Path(path).read_text(encoding="utf-8"), ())

    @classmethod
    def _of(cls, table: str, remarks: Iterable[str]) -> Shaper:
        filed = json.loads(table)
        stages = tuple(
            Stage(
                stage.get("frequency_hz"),
                stage.get("damping_ratio"),
                stage["type"],
                np.array([tap["delay_ticks"] for tap in stage["taps"]]),
                np.array([tap["weight"] for tap in stage["taps"]]),
                stage["weight_one"],
            )
            for stage in filed["stages"]
        )
        return cls(
            filed["rate_hz"],
            filed["duration_s"],
            filed["delay_s"],
            np.array([impulse["time_s"] for impulse in filed["impulses"]]),
            np.array([impulse["amplitude"] for impulse in filed["impulses"]]),
            stages,
            np.array(filed["residual"]["nominal"]),
            np.array(filed["residual"]["worst_over_box"]),
            filed["crc32"],
            tuple(remarks),
            table,
        )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the table, for ``stillbeam upload`` and :meth:`stillbeam.Board.upload`."""
        Path(path).write_text(self._table, encoding="utf-8")

    def apply(self, time_s: np.ndarray, command_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What the board makes of a command, in its integers (nanometres).

        Parameters
        ----------
        time_s, command_m
            Stamps in seconds and positions in metres within ±1 m, both of shape (n,).

        Returns
        -------
        time_s, setpoint_m
            One per tick of the board, both of shape (m,); the command's end is held until the shaper has run
            out.
        """
        signals = (np.ascontiguousarray(signal, dtype=np.float64) for signal in (time_s, command_m))
        shaped_s, setpoint_m = _stillbeam.convolve(self._table, *signals)
        return shaped_s, setpoint_m

    def vibration(self, frequency_hz: np.ndarray, damping_ratio: float = 0.0) -> np.ndarray:
        """Vibration that is left of a mode, a fraction of the unshaped command's.

        Parameters
        ----------
        frequency_hz
            Undamped natural frequencies, any shape.
        damping_ratio
            Of the mode, at least 0 and below 1.

        Returns
        -------
        numpy.ndarray
            Of the same shape: the magnitude of the sum of the impulses' decays when the last one has come.
        """
        omega = 2.0 * np.pi * np.asarray(frequency_hz, dtype=float)[..., None]
        decay = np.exp(damping_ratio * omega * (self.time_s - self.time_s[-1]))
        damped = omega * np.sqrt(1.0 - damping_ratio**2)
        return np.abs(np.sum(self.amplitude * decay * np.exp(1j * damped * self.time_s), axis=-1))

    def plot(self, frequency_hz: np.ndarray | None = None) -> Figure:
        """The impulses, and the vibration that is left over frequency."""
        plt = pyplot()
        figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.2))
        left.stem(self.time_s, self.amplitude, basefmt=" ")
        left.set_xlabel("time (s)")
        left.set_ylabel("amplitude")
        modes = [stage.frequency_hz for stage in self.stages if stage.frequency_hz]
        highest = 2.0 * max(modes) if modes else 4.0 / max(self.duration_s, 1e-9)
        hz = np.linspace(highest / 1000.0, highest, 1000) if frequency_hz is None else np.asarray(frequency_hz)
        right.plot(hz, 100.0 * self.vibration(hz))
        for mode in modes:
            right.axvline(mode, linewidth=0.6, linestyle=":")
        right.set_xlabel("frequency (Hz)")
        right.set_ylabel("vibration left (%)")
        right.set_ylim(bottom=0.0)
        figure.tight_layout()
        return figure

    def _repr_html_(self) -> str:
        stages = self.stages if len(self.stages) == len(self.residual) else [None] * len(self.residual)
        rows = [
            (
                "-" if stage is None or stage.frequency_hz is None else f"{stage.frequency_hz:.4g}",
                self.stages[0].type if stage is None else stage.type,
                f"{100.0 * nominal:.3g}",
                f"{100.0 * worst:.3g}",
            )
            for stage, nominal, worst in zip(stages, self.residual, self.residual_over_box, strict=True)
        ]
        title = f"Shaper of {self.duration_s:.4g} s at {self.rate_hz:.6g} Hz, {self.crc32}"
        header = ("mode (Hz)", "type", "vibration left (%)", "at worst (%)")
        return html_table(title, header, rows) + html_list(self.remarks)

    def __repr__(self) -> str:
        kinds = ", ".join(stage.type for stage in self.stages)
        return f"Shaper({kinds}, {self.duration_s:.4g} s, at worst {100 * self.residual_over_box.max():.3g} %)"


def shape(
    modes: Identification | str | os.PathLike[str] | Iterable[Any],
    *,
    type: str = "zvd",
    use: Iterable[int] = (),
    rate_hz: float = 4000.0,
    box: str = "5%",
    box_floor: str = "5%",
    tolerance: float | None = None,
    negative_limit: float = 0.0,
    longest_s: float | None = None,
) -> Shaper:
    """A shaper for modes, exactly as the board runs it.

    Parameters
    ----------
    modes
        What :func:`identify` found, a file of it, or modes as numbers: ``[(1.1, 0.0074), (6.9, 0.0059,
        "zvdd")]``, undamped frequency in Hz, damping ratio, and if wanted the type.
    type
        ``"zv"``, ``"zvd"``, ``"zvdd"``, ``"ei"``, ``"mzv"``, ``"si:0.05"`` and so on, of modes that name
        none.
    use
        Which of the identified modes, counted from 1; by default all.
    rate_hz
        Ticks per second; the board runs the nearest rate that divides its timer clock.
    box
        Where modes that are given as numbers may be: ``"5%"`` of both, or ``"5%,20%"`` of frequency and
        damping ratio.
    box_floor
        The least of that for identified modes, whose box is what was measured.
    tolerance
        The most vibration that any mode may keep anywhere in its box, a fraction; the result is then the
        shortest shaper that holds it, one stage for all modes.
    negative_limit, longest_s
        Of that: what negative weights may sum to, and the longest duration in seconds.

    Raises
    ------
    InputError
        A mode that is none, or a tolerance that no shaper holds, with what would do.
    """
    request = {
        "modes": [],
        "modes_file": None,
        "chosen": [int(number) for number in use],
        "kind": type,
        "uncertainty": box,
        "floor": box_floor,
        "rate_hz": float(rate_hz),
        "tolerance": tolerance,
        "negative_limit": float(negative_limit),
        "longest_s": longest_s,
    }
    if isinstance(modes, Identification):
        request["modes_file"] = ("identified modes", modes._modes_file)
    elif isinstance(modes, (str, os.PathLike)):
        request["modes_file"] = (os.fspath(modes), Path(modes).read_text(encoding="utf-8"))
    else:
        request["modes"] = [",".join(_word(part) for part in mode) for mode in modes]
    table, remarks = _stillbeam.shape(request)
    return Shaper._of(table, remarks)


def _word(part: Any) -> str:
    return part if isinstance(part, str) else repr(float(part))
