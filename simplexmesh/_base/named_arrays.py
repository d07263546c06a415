"""Named arrays with one row for each point or vertex: checked, and passed on; what meshes and points have in common."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh._base.errors import warn
from simplexmesh._base.html import card
from simplexmesh._base.units import InUnits

Data = Mapping[str, NDArray[Any]]

OF_MODELS = ("metric", "distance")
"""Arrays that every reconstruction adds: what leaves them out loses nothing that was in the data."""


def named_arrays(given: Any, n: int, row: str) -> Data:
    """Return named arrays of `n` rows, one for each `row`, as a read-only mapping of read-only arrays."""
    found = {} if given is None else checks.instance("data", given, Mapping)  # type: ignore[type-abstract]
    ours = isinstance(found, MappingProxyType)  # passed on from another object
    return MappingProxyType(
        {str(name): _checked(str(name), values, n, row, ours=ours) for name, values in found.items()}
    )


def _checked(name: str, values: Any, n: int, row: str, *, ours: bool) -> NDArray[Any]:
    given = checks.any_array(f"data {name!r}", values)
    if given.dtype.kind not in "biuf":
        raise TypeError(f"data {name!r} must be numbers, not {given.dtype}")
    if given.ndim == 0 or len(given) != n:
        raise ValueError(f"data {name!r} must have {n} rows, one for each {row}, not shape {given.shape}")
    return given if ours and not given.flags.writeable and given.flags.owndata else checks.frozen(given)


def taken(data: Data, rows: NDArray[Any]) -> dict[str, NDArray[Any]]:
    """Return some rows of all arrays, by a mask or indices."""
    return {name: values[rows] for name, values in data.items()}


def joined(parts: Sequence[Data]) -> dict[str, NDArray[Any]]:
    """Return the arrays that all parts have, one after the other; they must agree in shape. A warning names others."""
    names = [name for name in parts[0] if all(name in part for part in parts)]
    some = {name: None for part in parts for name in part if name not in (*names, *OF_MODELS)}
    if some:
        warn(f"arrays that not all parts have were left out: {', '.join(some)}")
    for name in names:
        if len(shapes := {part[name].shape[1:] for part in parts}) > 1:
            found = " and ".join(str(shape) for shape in sorted(shapes))
            raise ValueError(f"data {name!r} must have the same shape in all parts, not {found}")
    return {name: np.concatenate([part[name] for part in parts]) for name in names}


def is_color(values: NDArray[Any]) -> bool:
    """Whether an array holds colors: bytes in three columns, red, green and blue (sRGB), or four with opacity."""
    return values.dtype == np.uint8 and values.ndim == 2 and values.shape[1] in (3, 4)


Self = TypeVar("Self", bound="Located")


class Located(InUnits):
    """Places in space with named arrays.

    Attributes
    ----------
    data : mapping of str to array
        One row for each place.
    """

    data: Data

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"data": dict(self.data)}

    @cached_property
    def bounds(self) -> Array:
        """(2, 3) array of float: lowest and highest coordinates."""
        at = self.points if hasattr(self, "points") else self.vertices  # type: ignore[attr-defined]
        return checks.frozen(np.stack([at.min(axis=0), at.max(axis=0)]))

    def _repr_html_(self) -> str:
        """Return a small picture and a table, as notebooks show."""
        return card(repr(self), self._facts(), self)

    def _facts(self) -> dict[str, str]:
        """Return the rows of a table of what matters."""
        size = " x ".join(f"{side:.4g}" for side in np.ptp(self.bounds, axis=0))
        return {"size": f"{size} {self.unit or ''}".strip(), **({"arrays": ", ".join(self.data)} if self.data else {})}

    @property
    def diagonal(self) -> float:
        """Length of the diagonal of the bounding box."""
        return math.dist(*self.bounds)

    def with_data(self: Self, **arrays: ArrayLike | None) -> Self:
        """Return the same with named arrays added or replaced, one row for each place; None removes one.

        Examples
        --------
        >>> import numpy as np, simplexmesh as sm
        >>> list(sm.PointCloud(np.eye(4)[:, :3]).with_data(intensity=[1, 2, 3, 4]).data)
        ['intensity']
        """
        kept = {name: values for name, values in {**self.data, **arrays}.items() if values is not None}
        return replace(self, data=kept)  # type: ignore[type-var]

    def to_trimesh(self) -> Any:
        """Return a `trimesh.Trimesh` with colors and other arrays, of points a `trimesh.PointCloud` with colors only.

        Needs the extra `export`.
        """
        from simplexmesh.data import exporting

        return exporting.to_trimesh(self)

    def to_open3d(self) -> Any:
        """Return an `open3d.t.geometry` PointCloud or TriangleMesh with normals, colors and other arrays.

        Needs Open3D.
        """
        from simplexmesh.data import exporting

        return exporting.to_open3d(self)
