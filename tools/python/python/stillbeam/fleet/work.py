"""What a worker does for one machine."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

import stillbeam

from .journal import Entry
from .machine import Machine


def work(task: str, machine: Machine, key: str, options: Mapping[str, Any]) -> Entry:
    """Identifies or diagnoses a machine; a failure is a result as well, with its words."""
    began = time.perf_counter()
    try:
        rows, error = TASKS[task](machine, options), None
    except (stillbeam.StillbeamError, OSError, ValueError) as failure:
        rows, error = [], str(failure)
    return Entry(machine.name, key, time.perf_counter() - began, error, rows)


def _identify(machine: Machine, options: Mapping[str, Any]) -> list[dict[str, Any]]:
    found = stillbeam.identify(machine.recordings, **options)
    rows = []
    for number, mode in enumerate(found, 1):
        where = f"mode {number}"
        rows.append(_row("mode", where, "frequency", mode.frequency_hz, "Hz"))
        rows.append(_row("mode", where, "damping_ratio", mode.damping_ratio, ""))
        rows.append(_row("mode", where, "amplitude", mode.amplitude, ""))
    if found.fit_percent is not None:
        rows.append(_said("fit", found.output, "fit_percent", found.fit_percent, "%"))
    rows += [_said("warning", found.output, "", None, "", words) for words in found.warnings]
    return rows


def _diagnose(machine: Machine, options: Mapping[str, Any]) -> list[dict[str, Any]]:
    if machine.model is None:
        raise ValueError(f"{machine.name}: a diagnosis needs a model; give Machine(..., model=...)")
    found = stillbeam.diagnose(machine.model, machine.recordings, machine.held_out, **options)
    rows = [_said("verdict", "", found.verdict, None, "", found.sentence)]
    for effect in found.effects:
        for name, parameter in effect.parameters.items():
            stderr = float("nan") if parameter.stderr is None else parameter.stderr
            estimate = stillbeam.Estimate(parameter.value, stderr)
            rows.append(_row(effect.id, effect.location, name, estimate, parameter.unit))
    for change in found.parameter_changes:
        stderr = float("nan") if change.stderr is None else change.stderr
        rows.append(_row("parameter", change.path, "to", stillbeam.Estimate(change.to, stderr), ""))
    return rows


TASKS = {"identify": _identify, "diagnose": _diagnose}


def _row(what: str, where: str, quantity: str, estimate: stillbeam.Estimate, unit: str) -> dict[str, Any]:
    row = _said(what, where, quantity, estimate.value, unit)
    return {**row, "stderr": estimate.stderr}


def _said(what: str, where: str, quantity: str, value: float | None, unit: str, text: str = "") -> dict[str, Any]:
    return {
        "what": what,
        "where": where,
        "quantity": quantity,
        "value": value,
        "stderr": None,
        "unit": unit,
        "text": text,
    }
