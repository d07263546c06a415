"""A point cloud, with or without normals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh._base import checks, vectors
from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.errors import counted, warn
from simplexmesh._base.named_arrays import Data, Located, joined, named_arrays, taken
from simplexmesh._base.units import common_unit, unit_or_none
from simplexmesh.data.columns import are_colors, as_colors

COARSE = 1e-4
"""Steps of coordinates, in the extent of the cloud, that are told: in a plant of ten meters a millimeter."""

SOME = 1000
"""Points whose digits are looked at."""


@dataclass(frozen=True, eq=False, repr=False)
class PointCloud(Located):
    """Points measured on a surface.

    Parameters
    ----------
    points : (n, 3) array of float
        Positions, finite, at least four.
    normals : (n, 3) array of float, optional
        Directions away from the solid, of any length; stored as unit vectors. None if unknown.
    data : mapping of str to array, optional
        Named arrays with one row per point; bytes in three or four columns are colors (sRGB), "colors" in files.
    unit : str, optional
        Unit of length of the points: "nm", "um", "mm", "cm", "m", "km", "in" or "ft".

    Raises
    ------
    ValueError
        Wrong shape, fewer than four points, NaN or infinite values, normals of length zero, an unknown unit.
    TypeError
        Not real numbers.

    Notes
    -----
    ``np.asarray(cloud)`` is `points`.

    Examples
    --------
    >>> cloud = PointCloud([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 2]])
    >>> cloud
    PointCloud(4 points, without normals, diagonal 2.44949)
    """

    points: Array
    normals: Array | None = None
    data: Data = field(default_factory=dict)
    unit: str | None = None

    def __post_init__(self) -> None:
        points = _finite_rows("points", self.points)
        if len(points) < 4:
            raise ValueError(f"points must be at least 4, not {len(points)}")
        ours = points is self.points and points.flags.c_contiguous and not _is_writable(points)
        object.__setattr__(self, "points", points if ours else checks.frozen(points))
        object.__setattr__(self, "data", named_arrays(self.data, len(points), "point"))
        object.__setattr__(self, "unit", unit_or_none("unit", self.unit))
        if self.normals is None:
            return
        normals = _finite_rows("normals", self.normals)
        if len(normals) != len(points):
            raise ValueError(f"normals must have shape {points.shape}, not {normals.shape}")
        zero = int(np.count_nonzero(~normals.any(axis=1)))
        if zero:
            raise ValueError(f"normals must have a direction; {zero} of {len(normals)} are zero")
        _, exponents = np.frexp(np.abs(normals).max(axis=1, keepdims=True))
        scaled = np.ldexp(normals, -exponents)  # lengths whose squares overflow or vanish are legal
        object.__setattr__(self, "normals", checks.frozen(vectors.normalized(scaled)))

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:  # noqa: FBT001  as NumPy calls it
        if copy is False and dtype not in (None, self.points.dtype):
            raise ValueError(f"points must be copied to become {np.dtype(dtype)}")
        return np.array(self.points, dtype=dtype, copy=copy)

    def __len__(self) -> int:
        return len(self.points)

    def __repr__(self) -> str:
        with_normals = "without" if self.normals is None else "with"
        return f"PointCloud({len(self)} points, {with_normals} normals, diagonal {self.diagonal:g})"

    def transformed(self, T_target_source: ArrayLike) -> PointCloud:
        """Return the cloud in the target frame of a (4, 4) affine; normals stay outward under reflections; data stay.

        Examples
        --------
        >>> cloud = PointCloud(np.eye(4)[:, :3])
        >>> cloud.transformed(np.diag([2.0, 1.0, 1.0, 1.0])).points[0]
        array([2., 0., 0.])
        """
        T = checks.affine("T_target_source", T_target_source)
        normals = None if self.normals is None else self.normals @ np.linalg.inv(T[:3, :3])
        return PointCloud(self.points @ T[:3, :3].T + T[:3, 3], normals, self.data, self.unit)

    def merged(self) -> PointCloud:
        """Return the cloud with duplicate positions merged, their normals averaged, data of the first kept.

        Warns
        -----
        SimplexMeshWarning
            There were duplicate points; the message says how many.
        """
        first, inverse = distinct(self.points)
        duplicates = len(self) - len(first)
        if not duplicates:
            return self
        warn(f"merged {counted(duplicates, 'duplicate point', 'duplicate points')} of {len(self):,}")
        normals: Array | None = None
        if self.normals is not None:
            normals = vectors.sums(self.normals, inverse, len(first))
            opposed = vectors.norm(normals) < 1e-6
            normals[opposed] = self.normals[first[opposed]]
        return PointCloud(self.points[first], normals, taken(self.data, first), self.unit)

    def selected(self, at: ArrayLike) -> PointCloud:
        """Return some of the points, at least four, with their normals and data.

        Parameters
        ----------
        at : (n,) array of bool or (k,) array of int
            Which ones.

        Examples
        --------
        >>> cloud = PointCloud(np.mgrid[:2, :2, :2].reshape(3, 8).T, data={"weight": range(8)})
        >>> cloud.selected(cloud.points[:, 0] > 0).data["weight"]
        array([4, 5, 6, 7])
        """
        rows = checks.selection("at", at, len(self))
        normals = None if self.normals is None else self.normals[rows]
        return PointCloud(self.points[rows], normals, taken(self.data, rows), self.unit)

    @staticmethod
    def joined(clouds: Sequence[PointCloud]) -> PointCloud:
        """Return the concatenation of several clouds, of one unit; with normals and data that all of them have."""
        for k, cloud in enumerate(clouds):
            checks.instance(f"clouds[{k}]", cloud, PointCloud)
        if not clouds:
            raise ValueError("clouds must be at least one, not none")
        normals = [cloud.normals for cloud in clouds if cloud.normals is not None]
        return PointCloud(
            np.concatenate([cloud.points for cloud in clouds]),
            np.concatenate(normals) if len(normals) == len(clouds) else None,
            joined([cloud.data for cloud in clouds]),
            common_unit("clouds", clouds),
        )


def cloud_of_vertices(surface: Any) -> PointCloud:
    """Return the vertices of a mesh as points, with its data, and with their normals if all have one."""
    normals = surface.normals if hasattr(surface, "connectivity") else surface.vertex_normals
    known = normals.any(axis=1).all()
    return PointCloud(surface.vertices, normals if known else None, surface.data, surface.unit)


def cloud_of_rows(name: str, rows: NDArray[Any]) -> PointCloud:
    """Return the cloud of (n, 3) points or of (n, 6) points with normals, or with colors, which a warning tells."""
    if rows.shape[1] == 3:
        return PointCloud(rows)
    points, beside = rows[:, :3], rows[:, 3:]
    if are_colors(beside):
        warn(f"{name} of shape (*, 6) are points and colors, as the last three columns are no unit vectors and not < 0")
        return PointCloud(points, data={"colors": as_colors(beside)})
    if zero := int(np.count_nonzero(~beside.any(axis=1))):
        other = "points alone have shape (*, 3), other columns are data: PointCloud(points, data={'name': ...})"
        raise ValueError(f"{name} of shape (*, 6) are points and normals, of which {zero} are zero: {other}")
    return PointCloud(points, beside)


def cloud_of_file(
    name: str, points: Array, normals: Array | None, data: Data, unit: str | None = None, *, missing: bool = False
) -> PointCloud:
    """Return the cloud read from a file without points whose normals are zero or NaN, and warn of their number."""
    keep: Mask = np.ones(len(points), dtype=bool)
    if missing:
        keep &= np.isfinite(points).all(axis=1)
    if normals is not None:
        keep &= np.isfinite(normals).all(axis=1) & normals.any(axis=1)
    if keep.all():
        return PointCloud(points, normals, data, unit)
    dropped = int(np.count_nonzero(~keep))
    warn(f"{name}: left out {dropped:,} of {len(keep):,} points: not measured, or without a normal")
    return PointCloud(points[keep], None if normals is None else normals[keep], taken(data, keep), unit)


def distinct(positions: Array) -> tuple[Indices, Indices]:
    """Return the first row of each distinct position, in order of appearance, and the index among them of each row."""
    plus_zero: Array = np.ascontiguousarray(positions + 0.0, dtype=np.float64)
    rows = plus_zero.view(np.dtype((np.void, 24))).reshape(-1)
    _, first, inverse = np.unique(rows, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.zeros(len(first), dtype=np.int64)
    rank[order] = np.arange(len(first))
    return first[order], rank[inverse.reshape(-1)]


def _finite_rows(name: str, value: Any) -> Array:
    out = checks.any_array(name, value)
    if out.dtype.kind == "f" and out.ndim == 2:
        bad = len(out) - int(np.count_nonzero(np.isfinite(out).all(axis=1)))
        if bad:
            raise ValueError(f"{name} must be finite; {bad} of {len(out)} have NaN or infinite coordinates")
    return checks.array(name, out if out.dtype.kind in "biuf" else value, (None, 3))


def _is_writable(values: Any) -> bool:
    """Whether an array, or one that it is a view of, can be written to."""
    return isinstance(values, np.ndarray) and (values.flags.writeable or _is_writable(values.base))


def warn_of_steps(points: Array) -> None:
    """Warn if points (n, 3) have been 32-bit numbers far from the origin, which has put them on a coarse grid."""
    if not len(points):
        return
    extent = float(np.ptp(points, axis=0).max())
    few = points[:: -(-len(points) // SOME)]
    with np.errstate(all="ignore"):
        step = float(np.spacing(np.float32(np.abs(points).max())))
        coarse = step > COARSE * extent and (few == few.astype(np.float32)).all() and (few % (16 * step)).any()
    if coarse:
        warn(
            f"the points are on a grid of {step:g}, as 32-bit numbers are so far from the origin: "
            "shift them to it before they are stored as such"
        )
