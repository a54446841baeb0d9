"""Which physics a model left out."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _stillbeam
from .display import html_list, html_table, pyplot, with_error
from .model import Model, as_model
from .recording import Recording, as_list, as_recording

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Parameter:
    """A parameter of a law; a standard error that could not be estimated is ``None``."""

    value: float
    stderr: float | None
    unit: str

    def __str__(self) -> str:
        return f"{with_error(self.value, self.stderr)} {self.unit}".strip()


@dataclass(frozen=True)
class Effect:
    """Physics that was left out."""

    id: str
    """Of the law in the catalogue, such as ``"coulomb_friction"``."""
    location: str
    """Where it sits, such as ``"base"`` or ``"drive"``."""
    parameters: Mapping[str, Parameter]
    evidence: Mapping[str, float | None]
    """What speaks for it: ``delta_bic``, ``held_out_gain_db``, ``p_value``."""
    sentence: str


@dataclass(frozen=True)
class ParameterChange:
    """A parameter of the given model that the recordings contradict."""

    path: str
    from_: float
    to: float
    stderr: float | None


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Where a model and recordings differ, and why."""

    verdict: str
    """``"adequate"``, ``"explained"``, ``"improved"``, ``"ambiguous"`` or ``"unexplained"``."""
    sentence: str
    """The whole in a few sentences."""
    effects: tuple[Effect, ...]
    """Physics that was left out, in order of importance."""
    parameter_changes: tuple[ParameterChange, ...]
    notes: tuple[str, ...]
    """What the answer rests on and does not: what was not looked for, what judged it."""
    next_experiment: str | None
    """The run that would tell more, in the console's words or in prose."""
    refitted_model: Model
    """The given model with its own parameters refitted."""
    extended_model: Model | None
    """The same with the physics found."""
    result: Mapping[str, Any]
    """Everything that ``stillbeam diagnose --json`` writes."""
    _report: str

    def report(self, path: str | os.PathLike[str]) -> None:
        """Writes the report, one HTML file."""
        Path(path).write_text(self._report, encoding="utf-8")

    def plot(self) -> Figure:
        """The error of the model as given, refitted and extended, beside the noise, of every output."""
        plt = pyplot()
        pooled = self.result["fit"]["pooled"]
        figure, axis = plt.subplots(figsize=(7, 0.9 * len(pooled) + 1.2))
        names = {"given": "as given", "refitted_linear": "refitted", "extended": "with the physics found"}
        for key, words in names.items():
            values = [(fit.get(key) or {}).get("nrmse") for fit in pooled]
            rows = [row for row, value in enumerate(values) if value is not None]
            axis.plot([values[row] for row in rows], rows, "o", label=words)
        floors = [fit["given"]["noise_floor"] / fit["given"]["rms"] * fit["given"]["nrmse"] for fit in pooled]
        axis.plot(floors, range(len(pooled)), "|", markersize=18, color="black", label="noise")
        axis.set_yticks(range(len(pooled)), [f"{fit['output']} ({fit['role']})" for fit in pooled])
        axis.set_xscale("log")
        axis.set_xlabel("error / spread of the recorded output")
        axis.legend(fontsize="small")
        figure.tight_layout()
        return figure

    def _repr_html_(self) -> str:
        rows = [
            (effect.id, effect.location, "; ".join(f"{name} {value}" for name, value in effect.parameters.items()))
            for effect in self.effects
        ]
        table = html_table(f"Verdict: {self.verdict}", ("law", "where", "parameters"), rows)
        changed = [
            f"{change.path}: {with_error(change.to, change.stderr)} instead of {change.from_:.6g}"
            for change in self.parameter_changes
        ]
        following = [] if self.next_experiment is None else [f"Next: {self.next_experiment}"]
        return table + html_list([self.sentence, *changed, *self.notes, *following])

    def __repr__(self) -> str:
        named = ", ".join(f"{effect.id} at {effect.location}" for effect in self.effects)
        noted = f"; {len(self.notes)} notes" if self.notes else ""
        return f"Diagnosis({self.verdict}{': ' + named if named else ''}{noted})"


def diagnose(
    model: Model | str | os.PathLike[str],
    recordings: Recording | str | os.PathLike[str] | Iterable[Recording | str | os.PathLike[str]],
    held_out: Recording | str | os.PathLike[str] | Iterable[Recording | str | os.PathLike[str]] = (),
    *,
    time_limit_s: float | None = None,
    processor_limit_s: float | None = None,
    open_loop: bool = False,
    most_amplitude: float | None = None,
    velocity_m_s: float | None = None,
    acceleration_m_s2: float | None = None,
    travel_m: tuple[float, float] | None = None,
    progress: Callable[[float, str], object] | None = None,
) -> Diagnosis:
    """Where a model and recordings differ, and which physics was left out.

    The model is simulated on every recording, refitted within its own parameters, and what is then left is
    located and compared with a catalogue of physics.

    Parameters
    ----------
    model
        A model, or its file.
    recordings
        To train on; one whose role is ``"held_out"`` is held out.
    held_out
        To judge on, never trained on.
    time_limit_s, processor_limit_s
        Begin no further search after this many seconds, by the clock or of processor time.
    open_loop
        Take the recorded input as it is, even if the model has a controller and the recordings its reference.
    most_amplitude
        For the run proposed next, the largest amplitude, in the unit of the model's input; by default three
        times the largest recorded.
    velocity_m_s, acceleration_m_s2, travel_m
        What the machine allows in that run: velocity, acceleration, and both ends of the travel; by default
        the board's own settings as they come.
    progress
        Called with what share is done, 0 to 1, and what is being done.

    Raises
    ------
    InputError
        A model or a recording that cannot be used. Ctrl-C returns at once; what was begun ends in the
        background at its limit.
    """
    settings = {
        "open_loop": open_loop,
        "most_amplitude": most_amplitude,
        "velocity_m_s": velocity_m_s,
        "acceleration_m_s2": acceleration_m_s2,
        "travel_m": travel_m,
        "time_limit_s": time_limit_s,
        "processor_limit_s": processor_limit_s,
    }
    given = as_model(model)
    training, judging = ([as_recording(one)._parts() for one in as_list(all_)] for all_ in (recordings, held_out))
    text, report, refitted, extended = _stillbeam.diagnose(given._parts(), training, judging, settings, progress)
    found = json.loads(text)
    return Diagnosis(
        verdict=found["verdict"],
        sentence=found["sentence"],
        effects=tuple(_effect(effect) for effect in found["effects"]),
        parameter_changes=tuple(
            ParameterChange(change["path"], change["from"], change["to"], change["stderr"])
            for change in found["parameter_changes"]
        ),
        notes=tuple(found["caps"]),
        next_experiment=found["next_experiment"],
        refitted_model=Model(refitted, f"{given.name}, refitted"),
        extended_model=None if extended is None else Model(extended, f"{given.name}, extended"),
        result=found,
        _report=report,
    )


def _effect(filed: dict[str, Any]) -> Effect:
    parameters = {
        name: Parameter(value["value"], value["stderr"], value["unit"]) for name, value in filed["parameters"].items()
    }
    return Effect(filed["id"], filed["location"], parameters, filed["evidence"], filed["sentence"])
