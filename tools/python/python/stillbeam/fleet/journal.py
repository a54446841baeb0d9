"""What has been done, a line for every machine, written as soon as it is."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Entry:
    """One machine that is done."""

    machine: str
    key: str
    """What the result depends on; see :meth:`Machine.key`."""
    seconds: float
    """Of the work, on one worker."""
    error: str | None
    """Why there is no result."""
    rows: list[dict[str, Any]]
    """Findings: ``what``, ``where``, ``quantity``, ``value``, ``stderr``, ``unit``, ``text``."""


class Journal:
    """A file to which lines are added; the last line of a machine counts."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._entries = dict(_read(path))

    def entry(self, machine: str) -> Entry | None:
        """What is known of a machine."""
        return self._entries.get(machine)

    def is_done(self, machine: str, key: str) -> bool:
        """Whether the machine was done with these very inputs; one that failed is tried again."""
        entry = self._entries.get(machine)
        return entry is not None and entry.key == key and entry.error is None

    def add(self, entry: Entry) -> None:
        """Writes a machine down."""
        torn = self._path.exists() and not self._path.read_bytes()[-1:] in (b"", b"\n")
        with self._path.open("a", encoding="utf-8") as file:
            # A run that was killed may have left half a line.
            file.write(("\n" if torn else "") + json.dumps(asdict(entry)) + "\n")
        self._entries[entry.machine] = entry


def _read(path: Path) -> Mapping[str, Entry]:
    entries: dict[str, Entry] = {}
    if not path.exists():
        return entries
    for line in path.read_text(encoding="utf-8").splitlines():
        try:
            entry = Entry(**json.loads(line))
        except (ValueError, TypeError):
            continue
        entries[entry.machine] = entry
    return entries
