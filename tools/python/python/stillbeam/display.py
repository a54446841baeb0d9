"""How results show themselves in a notebook."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from typing import Any


def html_table(title: str, header: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """A table with a title."""
    head = "".join(f'<th scope="col">{escape(cell)}</th>' for cell in header)
    body = "".join("<tr>" + "".join(f"<td>{escape(str(cell))}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><caption>{escape(title)}</caption><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def html_list(lines: Iterable[str]) -> str:
    """Lines below each other; nothing where there are none."""
    items = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return f"<ul>{items}</ul>" if items else ""


def with_error(value: float, stderr: float | None) -> str:
    """``1.0981 ± 0.0003``: as many digits as the standard error leaves."""
    if stderr is None or not stderr > 0.0 or stderr != stderr:
        return f"{value:.6g}"
    from math import floor, log10

    digits = max(0, 1 - floor(log10(stderr)))
    if digits > 9 or abs(value) >= 1e6:
        return f"{value:.6g} ± {stderr:.1g}"
    return f"{value:.{digits}f} ± {stderr:.{digits}f}"


def pyplot() -> Any:
    """Matplotlib's pyplot.

    Raises
    ------
    ImportError
        With how to install it.
    """
    try:
        import matplotlib.pyplot as plt
    except ImportError as missing:
        raise ImportError("plots need matplotlib: pip install 'stillbeam[plot]'") from missing
    return plt
