"""Results as they are shown in a notebook: a table of what matters, and a small picture of a surface."""

from __future__ import annotations

import base64
import importlib
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any


def card(title: str, rows: Mapping[str, str], *shown: Any, values: Any = None) -> str:
    """Return a table of names and values as HTML, beside a picture of surfaces, if any, colored by `values`."""
    body = "".join(
        f"<tr><th align='left'>{escape(name)}</th><td>{escape(value)}</td></tr>" for name, value in rows.items()
    )
    return pictured(title, f"<table><caption><b>{escape(title)}</b></caption>{body}</table>", *shown, values=values)


def pictured(title: str, table: str, *shown: Any, values: Any = None) -> str:
    """Return a table beside a picture of surfaces, the first colored by `values`; the table if there are none."""
    if not shown:
        return table
    drawn = importlib.import_module("simplexmesh.plot.surface").thumbnail(*shown, values=values)
    picture = base64.b64encode(drawn).decode()
    image = f"<img alt='{escape(title)}' src='data:image/png;base64,{picture}' width='240'>"
    return f"<div style='display:flex;align-items:center;gap:1em'>{image}{table}</div>"


def grid(columns: Sequence[str], rows: Mapping[str, Sequence[str]]) -> str:
    """Return a table with a row of names above as HTML."""
    head = "".join(f"<th>{escape(name)}</th>" for name in ("", *columns))
    body = (
        f"<tr><th align='left'>{escape(name)}</th>{''.join(f'<td>{escape(cell)}</td>' for cell in cells)}</tr>"
        for name, cells in rows.items()
    )
    return f"<table><tr>{head}</tr>{''.join(body)}</table>"
