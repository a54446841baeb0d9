"""One page of what differs between the machines."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from html import escape

import numpy as np

from ..display import html_table
from .differences import Difference
from .journal import Entry

MOST_NAMED = 8

STYLE = """
:root { color-scheme: light dark; }
body { font: 16px/1.45 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; }
table { border-collapse: collapse; margin: 1rem 0; display: block; overflow-x: auto; }
caption { text-align: left; font-weight: 600; padding: .3rem 0; }
th, td { border-bottom: 1px solid #8884; padding: .25rem .6rem; text-align: left; }
"""


LIKE, FAR = "#1f77b4", "#d62728"


def page(entries: Iterable[Entry], differences: list[Difference]) -> str:
    """The page, one HTML file that needs nothing else."""
    head = f'<meta charset="utf-8"><meta name="viewport" content="width=device-width"><style>{STYLE}</style>'
    body = content(entries, differences)
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}<title>Fleet</title></head><body>{body}</body></html>\n'


def content(entries: Iterable[Entry], differences: list[Difference]) -> str:
    """What the page says, for a place that has a look of its own, such as a notebook."""
    entries = list(entries)
    failed = {entry.machine: entry.error for entry in entries if entry.error is not None}
    parts = [f"<h1>{len(entries)} machines</h1>", f"<p>{escape(_headline(entries, failed, differences))}</p>"]
    verdicts = Counter(row["quantity"] for entry in entries for row in entry.rows if row["what"] == "verdict")
    if verdicts:
        parts.append(html_table("Verdicts", ("verdict", "machines"), verdicts.most_common()))
    if differences:
        parts.append(_differences_table(differences))
    if failed:
        parts.append(html_table("Without a result", ("machine", "why"), sorted(failed.items())))
    return "\n".join(parts)


def _headline(entries: list[Entry], failed: dict[str, str], differences: list[Difference]) -> str:
    seconds = [entry.seconds for entry in entries]
    cost = f"{np.median(seconds):.2g} s a machine on one worker, {np.sum(seconds):.3g} s in all." if seconds else ""
    out = Counter(machine for difference in differences for machine in difference.far_out)
    if out:
        named = ", ".join(name for name, _ in out.most_common(MOST_NAMED))
        others = f" and {len(out) - MOST_NAMED} more" if len(out) > MOST_NAMED else ""
        says = f"Unlike the others: {named}{others}."
    else:
        says = "No machine is unlike the others."
    without = {0: "", 1: " One has no result."}.get(len(failed), f" {len(failed)} have no result.")
    return f"{says}{without} {cost}"


def _differences_table(differences: list[Difference]) -> str:
    head = ("what", "median", "spread", "standard error of one", "every machine", "unlike the others")
    header = "".join(f'<th scope="col">{cell}</th>' for cell in head)
    rows = "".join(_row(difference) for difference in differences)
    caption = "<caption>What differs, clearest first</caption>"
    return f"<table>{caption}<thead><tr>{header}</tr></thead><tbody>{rows}</tbody></table>"


def _row(difference: Difference) -> str:
    name = " ".join(part for part in (difference.what, difference.where, difference.quantity) if part)
    if difference.what == "mode":
        name = f"{difference.where}, {difference.quantity.replace('_', ' ')}"
    far = list(difference.far_out[:MOST_NAMED])
    if len(difference.far_out) > MOST_NAMED:
        far.append(f"{len(difference.far_out) - MOST_NAMED} more")
    spread = f"{difference.spread:.3g} ({100.0 * difference.relative_spread:.2g} %)"
    cells = (escape(name), f"{difference.median:.5g} {escape(difference.unit)}", spread, f"{difference.stderr:.2g}")
    written = "".join(f"<td>{cell}</td>" for cell in cells)
    return f"<tr>{written}<td>{_strip(difference)}</td><td>{escape(', '.join(far))}</td></tr>"


def _strip(difference: Difference) -> str:
    """Every machine as a point between the lowest and the highest."""
    low, high = min(difference.values.values()), max(difference.values.values())
    width = (high - low) or 1.0
    at = lambda value: 4.0 + 192.0 * (value - low) / width  # noqa: E731
    far = set(difference.far_out)
    points = "".join(
        f'<circle cx="{at(value):.1f}" cy="10" r="3" fill="{FAR if machine in far else LIKE}" fill-opacity="0.6">'
        f"<title>{escape(machine)}: {value:.5g}</title></circle>"
        for machine, value in difference.values.items()
    )
    middle = f'<line x1="{at(difference.median):.1f}" x2="{at(difference.median):.1f}" y1="1" y2="19" stroke="currentColor"/>'
    label = f"from {low:.5g} to {high:.5g}"
    return f'<svg viewBox="0 0 200 20" width="220" height="22" role="img" aria-label="{label}">{middle}{points}</svg>'
