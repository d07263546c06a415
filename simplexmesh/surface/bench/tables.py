"""Tables as CSV or Markdown."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Sequence
from typing import Any

Rows = Sequence[dict[str, Any]]


def as_csv(rows: Rows) -> str:
    """Return rows as CSV, one column for each key of the first.

    Examples
    --------
    >>> print(as_csv([{"method": "sine", "error": 0.25}]), end="")
    method,error
    sine,0.25
    """
    out = io.StringIO()
    writer = csv.DictWriter(out, list(rows[0]) if rows else [], lineterminator="\n")
    writer.writeheader()
    for row in rows:
        writer.writerow({name: _exact(value) for name, value in row.items()})
    return out.getvalue()


def as_markdown(rows: Rows, columns: Sequence[str] | None = None) -> str:
    """Return rows as a Markdown table of some columns, numbers to three digits.

    Examples
    --------
    >>> print(as_markdown([{"method": "sine", "error": 0.25}]))
    | method | error |
    |---|---|
    | sine | 0.25 |
    """
    names = list(columns or (rows[0] if rows else []))
    lines = ["| " + " | ".join(names) + " |", "|" + "---|" * len(names)]
    lines += ["| " + " | ".join(formatted(row.get(name)) for name in names) + " |" for row in rows]
    return "\n".join(lines)


def pivoted(rows: Rows, row: str, column: str, value: Callable[[dict[str, Any]], Any]) -> list[dict[str, Any]]:
    """Return a pivot table: one row per value of `row`, one column per value of `column`, in order of appearance.

    Examples
    --------
    >>> rows = [{"method": "sine", "size": 8, "error": 0.1}, {"method": "sine", "size": 16, "error": 0.025}]
    >>> pivoted(rows, "method", "size", lambda line: line["error"])
    [{'method': 'sine', '8': 0.1, '16': 0.025}]
    """
    out: dict[Any, dict[str, Any]] = {}
    for line in rows:
        out.setdefault(line[row], {row: line[row]})[str(line[column])] = value(line)
    return list(out.values())


def formatted(value: Any) -> str:
    """Return a value as text for a table.

    Examples
    --------
    >>> [formatted(value) for value in (True, 0.000123456, 2.0, None, "--", float("nan"), 1234567)]
    ['yes', '0.000123', '2', '', '`--`', '–', '1,234,567']
    """
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


def _exact(value: Any) -> Any:
    return f"{value:.10g}" if isinstance(value, float) else value


def bullets(lines: Iterable[str]) -> str:
    """Return lines as a Markdown list."""
    return "\n".join(f"- {line}" for line in lines)
