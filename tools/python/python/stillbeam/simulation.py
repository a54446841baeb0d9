"""Models under commands and recordings."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

from . import _stillbeam
from .display import html_list, html_table
from .model import Model, as_model
from .recording import Recording, as_recording
from .shaper import Shaper, table_of


@dataclass(frozen=True)
class Move:
    """A simulated move, and how good it was."""

    recording: Recording
    """Setpoint, base and tip."""
    rate_hz: float
    """Ticks per second."""
    settling_time_s: float | None
    """From the start until the tip stays within 2 % of the move; ``None`` where it never does."""
    overshoot_pct: float
    """Of the tip, percent of the move."""
    residual_peak_m: float
    """The largest deflection of the tip after the setpoint has come to rest, metres."""
    vibration_pct: float
    """The tip's vibration, percent of what the unshaped move leaves."""
    mode_vibration_pct: tuple[float, ...]
    """The same of each mode."""

    def _repr_html_(self) -> str:
        settling = "never" if self.settling_time_s is None else f"{self.settling_time_s:.3f} s"
        rows = [
            ("settling time (2 % band)", settling),
            ("overshoot", f"{self.overshoot_pct:.3g} %"),
            ("residual peak of the tip", f"{1e3 * self.residual_peak_m:.3g} mm"),
            ("vibration, of the unshaped move's", f"{self.vibration_pct:.3g} %"),
        ]
        return html_table("Simulated move", ("what", "value"), rows) + html_list(self.recording.remarks)


def simulate(
    model: Model | str | os.PathLike[str],
    driven_by: Recording | str | os.PathLike[str],
    *,
    shaper: Shaper | None = None,
    rate_hz: float | None = None,
    open_loop: bool = False,
    noise_seed: int | None = None,
) -> Recording:
    """What a model does.

    Parameters
    ----------
    model
        A model, or its file.
    driven_by
        A recording that has the model's input column; or a command in the console's words, such as ``"sweep
        linear 0.5 8 0.1Hz/s 200mm/s2"`` or ``"move 50mm"``.
    shaper
        What the command, or the recorded input, goes through.
    rate_hz
        Ticks per second of a command; by default the shaper's, or 4000.
    open_loop
        Take the recorded input as it is, even if the model has a controller and the recording its reference.
    noise_seed
        A draw of the noise that the model states of its sensors; without it there is none.

    Returns
    -------
    Recording
        The model's outputs at the recording's times, or at the ticks.
    """
    setup = _setup(model, shaper, open_loop, noise_seed)
    if isinstance(driven_by, str) and driven_by.split(" ")[0] in _MOTIONS:
        parts, _numbers, remarks = _stillbeam.simulate_command(setup, driven_by, rate_hz)
        return Recording._of(parts, remarks)
    if rate_hz is not None:
        raise _stillbeam.InputError("rate_hz goes with a command; a recording brings its own times")
    return Recording._of(_stillbeam.simulate(setup, as_recording(driven_by)._parts()))


def simulate_move(
    model: Model | str | os.PathLike[str],
    command: str,
    *,
    shaper: Shaper | None = None,
    rate_hz: float | None = None,
) -> Move:
    """A move of the base, such as ``"move 50mm"``, within the firmware's default limits.

    Raises
    ------
    InputError
        A command that comes back, which :func:`simulate` takes; a model that is not driven by a motion.
    """
    parts, numbers, remarks = _stillbeam.simulate_command(_setup(model, shaper, False, None), command, rate_hz)
    if numbers is None:
        raise _stillbeam.InputError(f"{command!r} ends where it began, so nothing settles; use stillbeam.simulate")
    *scalars, modes_pct = numbers
    return Move(Recording._of(parts, remarks), *scalars, tuple(modes_pct))


_MOTIONS = ("move", "sweep", "multisine", "pulse", "decay")


def _setup(model: Any, shaper: Shaper | None, open_loop: bool, noise_seed: int | None) -> dict[str, Any]:
    return {
        "model": as_model(model)._parts(),
        "shaper": None if shaper is None else table_of(shaper),
        "open_loop": open_loop,
        "noise_seed": noise_seed,
    }
