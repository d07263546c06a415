"""What goes into a target and what comes out: arrays that fit, or one sentence about those that do not."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check

Array = NDArray[np.float64]
FLOAT = np.dtype(np.float64)


class BuiltIn:
    """A target of this library: it does not write into the arrays it is asked about, so that it may see them all."""


def ask(target: Any, vertices: Array, normals: Array, reach: float, name: str = "target") -> Array:
    """Return the gaps a target answers, and refuse an answer that is not one number per vertex.

    A target of the user's own sees the arrays, and cannot change them.

    Raises
    ------
    ValueError
        The answer has another shape.
    """
    if not isinstance(target, BuiltIn):
        vertices, normals = read_only(vertices), read_only(normals)
    gaps = np.asarray(target.gap(vertices, normals, reach))
    if gaps.shape != (len(vertices),):
        raise ValueError(f"{name}.gap must return shape ({len(vertices)},), not {gaps.shape}")
    if gaps.dtype.kind not in "iuf":
        raise TypeError(f"{name}.gap must return numbers, not {gaps.dtype}")
    return gaps.astype(np.float64, copy=False)


def read_only(values: NDArray[Any]) -> NDArray[Any]:
    """Return a view that cannot be written to.

    Examples
    --------
    >>> read_only(np.zeros(3)).flags.writeable
    False
    """
    view = values.view()
    view.setflags(write=False)
    return view


def checked(vertices: ArrayLike, normals: ArrayLike, reach: float) -> tuple[Array, Array, float]:
    """Return the arguments of `gap` as kernels want them, untouched where they are so already.

    Raises
    ------
    ValueError, TypeError
        Other shapes than (n, 3), different lengths, no numbers, a reach that is not above 0.

    Examples
    --------
    >>> checked([[0, 0, 0]], [[0, 0, 1], [0, 0, 1]], 1.0)
    Traceback (most recent call last):
    ...
    ValueError: normals must have shape (1, 3), as vertices have, not (2, 3)
    """
    points, outward = _rows("vertices", vertices), _rows("normals", normals)
    if len(points) != len(outward):
        raise ValueError(f"normals must have shape {points.shape}, as vertices have, not {outward.shape}")
    return points, outward, reach_above_zero(reach)


def reach_above_zero(reach: float) -> float:
    """Return a reach as a float; infinity is one.

    Examples
    --------
    >>> reach_above_zero(math.inf)
    inf
    """
    if type(reach) is float and reach > 0.0:
        return reach
    if isinstance(reach, float | np.floating) and reach == math.inf:
        return math.inf
    return _check.number("reach", reach, 0.0, open_low=True)


def _rows(name: str, value: ArrayLike) -> Array:
    """Return (n, 3) floats, copied where a kernel would have to be compiled once more for them."""
    if type(value) is np.ndarray and value.dtype == FLOAT and value.ndim == 2 and value.shape[1] == 3:
        flags = value.flags
        return value if flags.c_contiguous and flags.writeable else value.copy(order="C")
    try:
        out = np.asarray(value)
    except ValueError:
        raise ValueError(f"{name} must be an array of shape (*, 3), its rows have different lengths") from None
    if out.dtype.kind not in "biuf":
        raise TypeError(f"{name} must be numbers of shape (*, 3), not {type(value).__name__} of {out.dtype}")
    if out.ndim != 2 or out.shape[1] != 3:
        raise ValueError(f"{name} must have shape (*, 3), not {out.shape}")
    return np.array(out, dtype=np.float64, order="C")
