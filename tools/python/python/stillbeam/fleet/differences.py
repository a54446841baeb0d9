"""What differs between the machines of a fleet.

Of every quantity that at least four machines have: its median, its spread (1.4826 times the median distance
from the median, which is the standard deviation where the machines are normally distributed and does not care
for a few that are not), and the machines that lie further out than 3.5 spreads (Iglewicz and Hoaglin, "How to
Detect and Handle Outliers", 1993).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from .journal import Entry

FEWEST = 4
FAR_OUT = 3.5
NORMAL = 1.4826
NEAR = 0.2
"""How far a mode may be from the fleet's, as a fraction, and still be the same one."""


@dataclass(frozen=True)
class Difference:
    """A quantity over the fleet."""

    what: str
    where: str
    quantity: str
    unit: str
    values: dict[str, float]
    """By machine."""
    median: float
    spread: float
    """The machines' own, in the quantity's unit."""
    stderr: float
    """Of a typical machine's estimate: a spread that is not larger says nothing of the machines."""
    far_out: tuple[str, ...]
    """Machines that lie further than 3.5 spreads from the median, furthest first."""

    @property
    def relative_spread(self) -> float:
        """The spread as a fraction of the median."""
        return self.spread / abs(self.median) if self.median else float("inf")

    @property
    def clearness(self) -> float:
        """The spread in standard errors of one machine's estimate: how surely the machines differ."""
        return self.spread / self.stderr if self.stderr > 0.0 else 0.0


def differences(entries: Iterable[Entry]) -> list[Difference]:
    """Of every quantity, the clearest difference first."""
    gathered: dict[tuple[str, str, str, str], dict[str, tuple[float, float]]] = {}
    for entry in entries:
        for row in entry.rows:
            if row["value"] is not None and row["what"] != "fit":
                name = (row["what"], row["where"], row["quantity"], row["unit"])
                stderr = row["stderr"] if row["stderr"] is not None else float("nan")
                gathered.setdefault(name, {})[entry.machine] = (row["value"], stderr)
    found = [_difference(name, of) for name, of in gathered.items() if len(of) >= FEWEST]
    return sorted(found, key=lambda difference: -difference.clearness)


def _difference(name: tuple[str, str, str, str], of: dict[str, tuple[float, float]]) -> Difference:
    values = {machine: value for machine, (value, _) in of.items()}
    stderrs = np.array([stderr for _, stderr in of.values()])
    stderr = float(np.median(stderrs[np.isfinite(stderrs)])) if np.isfinite(stderrs).any() else float("nan")
    median = float(np.median(list(values.values())))
    spread = NORMAL * float(np.median(np.abs(np.array(list(values.values())) - median)))
    # Machines that are all alike differ by what their estimates do.
    scale = max(spread, stderr if np.isfinite(stderr) else 0.0)
    distances = {machine: abs(value - median) for machine, value in values.items()}
    far_out = [machine for machine, distance in distances.items() if distance > FAR_OUT * scale]
    far_out.sort(key=lambda machine: -distances[machine])
    return Difference(*name, values, median, spread, stderr, tuple(far_out))


def in_common_order(entries: list[Entry]) -> list[Entry]:
    """Gives the modes of all machines common numbers: those of the machines with the most usual count, nearest
    frequency first. A mode that is near none of them is called ``further mode``."""
    frequencies = [_frequencies(entry) for entry in entries]
    counts = Counter(len(found) for found in frequencies if found)
    if not counts:
        return entries
    usual = max(counts, key=lambda count: (counts[count], count))
    reference = np.median([list(found.values()) for found in frequencies if len(found) == usual], axis=0)
    return [_renamed(entry, _numbers(found, reference)) for entry, found in zip(entries, frequencies, strict=True)]


def _frequencies(entry: Entry) -> dict[str, float]:
    return {
        row["where"]: row["value"] for row in entry.rows if row["what"] == "mode" and row["quantity"] == "frequency"
    }


def _numbers(found: dict[str, float], reference: np.ndarray) -> dict[str, str]:
    pairs = sorted(
        (abs(np.log(hz / reference_hz)), where, number)
        for where, hz in found.items()
        for number, reference_hz in enumerate(reference, 1)
    )
    names: dict[str, str] = {}
    taken: set[int] = set()
    for distance, where, number in pairs:
        if distance <= np.log1p(NEAR) and where not in names and number not in taken:
            names[where] = f"mode {number}"
            taken.add(number)
    others = (where for where in found if where not in names)
    return names | {where: f"further mode {number}" for number, where in enumerate(others, 1)}


def _renamed(entry: Entry, names: dict[str, str]) -> Entry:
    rows = [
        {**row, "where": names.get(row["where"], row["where"])} if row["what"] == "mode" else row for row in entry.rows
    ]
    return replace(entry, rows=rows)
