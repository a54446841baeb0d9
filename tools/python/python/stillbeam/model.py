"""Models of machines."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Model:
    """A model file's text (``docs/models.md`` says what is in it) and the name that messages call it by."""

    text: str
    name: str = "model"

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Model:
        """Reads a model file."""
        return cls(Path(path).read_text(encoding="utf-8"), os.fspath(path))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes it, for ``stillbeam simulate`` and ``stillbeam diagnose``."""
        Path(path).write_text(self.text, encoding="utf-8")

    def __str__(self) -> str:
        return self.text

    def _parts(self) -> tuple[str, str]:
        return self.name, self.text


def as_model(given: Model | str | os.PathLike[str]) -> Model:
    """A model, or the one in a file."""
    return given if isinstance(given, Model) else Model.read(given)
