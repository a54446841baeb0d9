"""Models of machines."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from . import _stillbeam


@dataclass(frozen=True, repr=False)
class Model:
    """A model file's text (``docs/models.md`` says what is in it) and the name that messages call it by."""

    text: str
    name: str = "model"

    def __post_init__(self) -> None:
        if not isinstance(self.text, str):
            raise TypeError(f"a model is the text of a model file, not a {type(self.text).__name__}; Model.read(path) reads one")
        if "\n" not in self.text and self.text.endswith(".toml"):
            raise _stillbeam.InputError(f"{self.text} is a path and no model; Model.read reads the file")
        _stillbeam.check_model(self._parts())

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Model:
        """Reads a model file."""
        return cls(Path(path).read_text(encoding="utf-8"), os.fspath(path))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes it, for ``stillbeam simulate`` and ``stillbeam diagnose``."""
        Path(path).write_text(self.text, encoding="utf-8")

    def __str__(self) -> str:
        return self.text

    def __repr__(self) -> str:
        return f"Model({self.name!r}, {len(self.text.splitlines())} lines)"

    def _parts(self) -> tuple[str, str]:
        return self.name, self.text


def as_model(given: Model | str | os.PathLike[str]) -> Model:
    """A model, or the one in a file."""
    return given if isinstance(given, Model) else Model.read(given)
