"""The tables of the comparison in Markdown: ratings, tori, tilted normals, borders."""

from __future__ import annotations

from typing import Any

from simplexmesh.bench.tables import Rows, as_markdown, formatted, pivoted
from simplexmesh.bench.trials import meshes
from simplexmesh.bench.trials.published import CRITERIA, OTHERS, THESIS


def rating_table(kind: str, rows: Rows) -> str:
    """Return our ratings and, where the thesis has other ones, those in brackets."""
    lines = []
    for row in rows:
        cells = {name: formatted(row[name]) for name in CRITERIA}
        for name, theirs in zip(CRITERIA, THESIS[kind].get(row["method"], ()), strict=False):
            if row[name] not in ("", theirs):
                cells[name] += f" (thesis {formatted(theirs)})"
        lines.append({"method": row["method"], **cells})
    return as_markdown(lines)


def tilts(rows: Rows, quantity: str) -> str:
    """Return the errors of a quantity by the tilt of the initial normal, empty if there are none."""
    lines = [line for line in rows if line["quantity"] == quantity]
    return as_markdown(pivoted(lines, "method", "degrees", "error")) if lines else ""


def tori(rows: Rows, quantity: str) -> str:
    """Return the errors of a quantity on tori, of H also other programs', empty if there are none."""
    lines = [line for line in rows if line["quantity"] == quantity]
    if not lines:
        return ""
    table = pivoted(lines, "method", "case", lambda line: _partly(line["error"], line["failed"] / line["vertices"]))
    if quantity == "H":
        titles = [case.title for case in meshes.CASES]
        table += [
            {"method": f"*{name}*"} | dict(zip(titles, map(float, v), strict=False)) for name, v in OTHERS.items()
        ]
    return as_markdown(table)


def borders(rows: Rows) -> str:
    """Return the errors inside and at the border by the noise."""
    return as_markdown(pivoted(rows, "method", "noise", border_cell))


def border_cell(line: dict[str, Any]) -> str:
    """Return the errors inside and at the border as text."""
    failed = line["failed at the border"]
    return f"{formatted(line['inside'])} / {'none' if failed == 1 else _partly(line['border'], failed)}"


def _partly(error: float, failed: float) -> str:
    """Return an error as text, with the share of vertices without an estimate."""
    return formatted(error) + (f" ({100 * failed:.0f} %)" if failed >= 0.005 else "")
