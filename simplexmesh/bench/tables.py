"""Tables as Markdown."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

Rows = Sequence[dict[str, Any]]


def as_markdown(rows: Rows, columns: Sequence[str] | None = None) -> str:
    """Return rows as a Markdown table of some columns, numbers to three digits."""
    names = list(columns or (rows[0] if rows else []))
    lines = ["| " + " | ".join(names) + " |", "|" + "---|" * len(names)]
    lines += ["| " + " | ".join(formatted(row.get(name)) for name in names) + " |" for row in rows]
    return "\n".join(lines)


def pivoted(rows: Rows, row: str, column: str, value: str | Callable[[dict[str, Any]], Any]) -> list[dict[str, Any]]:
    """Return a pivot table: rows and columns in order of appearance, cells from a column or a function of the row."""
    out: dict[Any, dict[str, Any]] = {}
    for line in rows:
        cell = line[value] if isinstance(value, str) else value(line)
        out.setdefault(line[row], {row: line[row]})[str(line[column])] = cell
    return list(out.values())


def formatted(value: Any) -> str:
    """Return a value as text for a table: numbers to three digits, signs of ratings as code, empty for None."""
    if value is None:
        return ""
    if isinstance(value, bool) or type(value).__name__ == "bool":
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    if isinstance(value, float):
        return "–" if value != value else f"{value:.3g}"
    text = str(value)
    return f"`{text}`" if text and set(text) <= set("+-/") else text.replace("|", "\\|")
