"""Facts as JSON text."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any


def json_text(facts: Any) -> str:
    """Return facts as JSON, which has null for numbers that are not finite; lists of plain values are on one line."""
    return _indented(_plain(facts), "")


def _indented(value: Any, pad: str) -> str:
    """Return a plain value as text whose further lines begin with a pad."""
    inner = pad + "  "
    items: Iterable[str]
    if isinstance(value, dict) and value:
        items = (f"{json.dumps(name)}: {_indented(each, inner)}" for name, each in value.items())
    elif isinstance(value, list) and any(isinstance(each, dict | list) for each in value):
        items = (_indented(each, inner) for each in value)
    else:
        return json.dumps(value, allow_nan=False)
    first, last = "{}" if isinstance(value, dict) else "[]"
    return f"{first}\n{inner}" + f",\n{inner}".join(items) + f"\n{pad}{last}"


def _plain(value: Any) -> Any:
    """Return a value of types that JSON can hold."""
    if isinstance(value, Mapping):
        return {str(name): _plain(inner) for name, inner in value.items()}
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return str(value) if isinstance(value, Path) else value
