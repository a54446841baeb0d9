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
from .identification import Identification, Mode

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
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


@dataclass(frozen=True, eq=False)
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
        text = Path(path).read_text(encoding="utf-8")
        try:
            return cls._of(text, ())
        except (ValueError, KeyError, TypeError):
            raise _stillbeam.InputError(
                f"{os.fspath(path)}: is no table; `stillbeam shape --json` and Shaper.save write one"
            ) from None

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
    type: str | None = None,
    use: int | Iterable[int] = (),
    rate_hz: float = 4000.0,
    box: str | None = None,
    box_floor: str | None = None,
    tolerance: float | None = None,
    negative_limit: float = 0.0,
    longest_s: float | None = None,
) -> Shaper:
    """A shaper for modes, exactly as the board runs it.

    Parameters
    ----------
    modes
        What :func:`identify` found, some of its modes (``found[:2]``), a file of it, or modes as numbers:
        ``[(1.1, 0.0074), (6.9, 0.0059, "zvdd")]``, undamped frequency in Hz, damping ratio, and if wanted the
        type.
    type
        ``"zv"``, ``"zvd"`` (the default), ``"zvdd"``, ``"ei"``, ``"mzv"``, ``"si:0.05"`` and so on, of modes
        that name none; not with a tolerance.
    use
        Which of the identified modes, counted from 1; by default all.
    rate_hz
        Ticks per second; the board runs the nearest rate that divides its timer clock.
    box
        Where modes that are given as numbers may be, in percent: ``"5%"`` (the default) of both, or
        ``"5%,20%"`` of frequency and damping ratio.
    box_floor
        Where identified modes may be at least, in the same words: their box is what was measured, and no less
        than this, ``"5%"`` by default.
    tolerance
        The most vibration that any mode may keep anywhere in its box, a fraction; the result is then the
        shortest shaper that holds it, one stage for all modes.
    negative_limit, longest_s
        Of that: what negative weights may sum to, and the longest duration in seconds.

    Raises
    ------
    InputError
        A mode that is none, a tolerance that no shaper holds, with what would do, or an option that says
        nothing beside another.
    """
    numbers, modes_file, chosen = _modes(modes, [use] if isinstance(use, int) else list(use))
    if modes_file is None and (box_floor is not None or chosen):
        raise _stillbeam.InputError("box_floor and use are for identified modes; these have a box, and are all shaped")
    if modes_file is not None and box is not None:
        raise _stillbeam.InputError("identified modes have boxes of their own; box_floor says how wide they are at least")
    if tolerance is not None and type is not None:
        raise _stillbeam.InputError("a tolerance gives one stage of its own kind for all modes; leave type or tolerance out")
    request = {
        "modes": numbers,
        "modes_file": modes_file,
        "chosen": chosen,
        "kind": type or "zvd",
        "uncertainty": _percentage("box", box),
        "floor": _percentage("box_floor", box_floor),
        "rate_hz": float(rate_hz),
        "tolerance": None if tolerance is None else float(tolerance),
        "negative_limit": float(negative_limit),
        "longest_s": longest_s,
    }
    table, remarks = _stillbeam.shape(request)
    return Shaper._of(table, remarks)


def table_of(shaper: Shaper) -> str:
    """The text of a shaper's table.

    Raises
    ------
    TypeError
        For what is no shaper.
    """
    if not isinstance(shaper, Shaper):
        raise TypeError(f"a {type(shaper).__name__} is no shaper; stillbeam.shape designs one, Shaper.read reads one")
    return shaper._table


def _modes(given: Any, use: list[int]) -> tuple[list[str], tuple[str, str] | None, list[int]]:
    """Modes as numbers; or the name and the text of a file of modes, and which of them."""
    if isinstance(given, Identification):
        return [], ("identified modes", given._modes_file), use
    if isinstance(given, (str, os.PathLike)):
        return [], (os.fspath(given), Path(given).read_text(encoding="utf-8")), use
    modes = [given] if isinstance(given, Mode) else list(given)
    if modes and all(isinstance(mode, Mode) for mode in modes):
        texts = {mode._place[0] for mode in modes}
        if len(texts) > 1 or use:
            raise _stillbeam.InputError("give modes of one identification, and either some of them or use")
        return [], ("identified modes", texts.pop()), [mode._place[1] for mode in modes]
    if not all(isinstance(mode, (tuple, list)) for mode in modes):
        raise TypeError("a mode is (frequency_hz, damping_ratio) or (frequency_hz, damping_ratio, type), or one of identify()'s")
    return [",".join(_word(part) for part in mode) for mode in modes], None, use


def _word(part: Any) -> str:
    return part if isinstance(part, str) else repr(float(part))


def _percentage(name: str, given: str | None) -> str:
    if given is None:
        return "5%"
    if not isinstance(given, str) or "%" not in given:
        raise _stillbeam.InputError(f'{name} {given!r}: give percentages, "5%" or "5%,20%"')
    return given
