"""Options that are true or false: words for one of them are a mistake, not true."""

from __future__ import annotations

from typing import Any

import numpy as np


def flag(name: str, value: Any) -> bool:
    """Return `value` as a bool, or say what it was.

    Raises
    ------
    TypeError
        It is neither true nor false.

    Examples
    --------
    >>> flag("weighted", "no")
    Traceback (most recent call last):
    ...
    TypeError: weighted must be true or false, not str 'no'
    """
    if not isinstance(value, bool | np.bool_):
        raise TypeError(f"{name} must be true or false, not {type(value).__name__} {value!r}")
    return bool(value)
