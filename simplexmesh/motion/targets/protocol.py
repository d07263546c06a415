"""The target protocol, and checks of the arguments and results of `gap`."""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array

FLOAT = np.dtype(np.float64)


class Target(Protocol):
    """Data that attracts a mesh: any object with a method `gap`."""

    def gap(self, vertices: Array, normals: Array, reach: float) -> Array:
        """Return (n,) the signed distance along its normal from each vertex to the data; NaN where none is in `reach`.

        The arrays are read-only views of the model's own; `reach` may be infinite.
        """


def check_target(target: Any, name: str = "target") -> None:
    """Raise a TypeError for a target without a method `gap`."""
    if not callable(getattr(target, "gap", None)):
        raise TypeError(f"{name} must have a method gap(vertices, normals, reach), not {type(target).__name__}")


class BuiltInTarget:
    """Base class of this library's targets, which do not write to their arguments and so need no read-only views."""

    def errors(self, points: Array) -> Array | None:
        """Return one standard deviation (n, 3) of the error of data points, along its direction; None if unknown."""
        return None


def target_gaps(target: Any, vertices: Array, normals: Array, reach: float, name: str = "target") -> Array:
    """Return the gaps of a target, checked: one number per vertex."""
    if not isinstance(target, BuiltInTarget):
        vertices, normals = read_only(vertices), read_only(normals)
    gaps = np.asarray(target.gap(vertices, normals, reach))
    if gaps.shape != (len(vertices),):
        raise ValueError(f"{name}.gap must return shape ({len(vertices)},), not {gaps.shape}")
    if gaps.dtype.kind not in "iuf":
        raise TypeError(f"{name}.gap must return numbers, not {gaps.dtype}")
    return gaps.astype(np.float64, copy=False)


def read_only(values: NDArray[Any]) -> NDArray[Any]:
    """Return a view that cannot be written to."""
    view = values.view()
    view.setflags(write=False)
    return view


def checked_arguments(vertices: ArrayLike, normals: ArrayLike, reach: float) -> tuple[Array, Array, float]:
    """Return the arguments of `gap` as kernels need them, uncopied if they already are."""
    points, outward = _rows("vertices", vertices), _rows("normals", normals)
    if len(points) != len(outward):
        raise ValueError(f"normals must have shape {points.shape}, as vertices have, not {outward.shape}")
    return points, outward, checked_reach(reach)


def checked_reach(reach: float) -> float:
    """Return a positive reach as a float; infinity is allowed."""
    if type(reach) is float and reach > 0.0:
        return reach
    if isinstance(reach, float | np.floating) and reach == math.inf:
        return math.inf
    return checks.number("reach", reach, 0.0, open_low=True)


def _rows(name: str, value: ArrayLike) -> Array:
    """Return (n, 3) floats, copied if a kernel would have to be compiled again for their layout."""
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
