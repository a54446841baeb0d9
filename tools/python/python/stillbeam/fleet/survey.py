"""What was found of a fleet."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from .differences import Difference, differences, in_common_order
from .journal import Entry
from .page import content, page

if TYPE_CHECKING:
    import pandas

COLUMNS = ("machine", "what", "where", "quantity", "value", "stderr", "unit", "text", "seconds", "error")


@dataclass(frozen=True)
class Survey:
    """What was found of a fleet."""

    entries: tuple[Entry, ...]
    """Machine by machine."""

    @classmethod
    def of(cls, entries: Iterable[Entry]) -> Survey:
        """Modes are called by the same number in all machines, whoever has one that others lack."""
        return cls(tuple(in_common_order(list(entries))))

    @property
    def table(self) -> pandas.DataFrame:
        """A row for every finding of every machine, and one with ``error`` for a machine that failed. ``seconds``
        is what the machine took on one worker."""
        import pandas

        rows = []
        for entry in self.entries:
            of_machine = {"machine": entry.machine, "seconds": entry.seconds, "error": entry.error}
            rows += [{**row, **of_machine} for row in entry.rows] or [of_machine]
        table = pandas.DataFrame(rows, columns=list(COLUMNS))
        numbers = ["value", "stderr", "seconds"]
        return table.astype({name: "float64" if name in numbers else "string" for name in COLUMNS})

    @property
    def failed(self) -> dict[str, str]:
        """Machines without a result, and why."""
        return {entry.machine: entry.error for entry in self.entries if entry.error is not None}

    @property
    def differences(self) -> list[Difference]:
        """What differs between the machines, clearest first."""
        return differences(self.entries)

    def save(self, folder: Path) -> None:
        """Writes ``table.parquet`` and ``page.html``."""
        self.table.to_parquet(folder / "table.parquet", index=False)
        (folder / "page.html").write_text(page(self.entries, self.differences), encoding="utf-8")

    def __len__(self) -> int:
        return len(self.entries)

    def _repr_html_(self) -> str:
        return content(self.entries, self.differences)
