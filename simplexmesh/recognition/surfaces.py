"""What is to be registered: points on a surface, normals away from the solid, how dense and how noisy they are."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from simplexmesh._vec import dot, norm
from simplexmesh.data.convert import as_data
from simplexmesh.data.points import distinct
from simplexmesh.data.volume import Volume
from simplexmesh.errors import TopologyError
from simplexmesh.motion.initial.orientation import oriented_indicator
from simplexmesh.motion.initial.planes import Planes
from simplexmesh.motion.outward import STRAIGHT, sense
from simplexmesh.motion.subjects import PointsSubject, TrianglesSubject, as_subject
from simplexmesh.motion.targets.borders import border_of_points
from simplexmesh.recognition import _kernels_planes

Array = NDArray[np.float64]

MOST_POINTS = 40_000
"""More are thinned out at random; the pose gains nothing that its covariance would show."""

FEWEST_POINTS = 50
THINNEST = 1e-3
"""Points whose second extent is less than this of the largest lie on a line."""

FEW, MANY, NOISY = 16, 40, 0.25
MEASURED = 2_000
"""Spacing and noise are taken from about so many points."""

ALIKE = 0.5
"""Points of one surface are nearer to each other than this share of the other's extent, or they are in two units."""

AMONG = 6
"""Points are strays or not by how far their so many-th neighbor is, they the first."""

SMOOTHED = 0.35
TURNED_POINTS, BORDERING = 4_000, 2_000
CELLS = 32


@dataclass(frozen=True, eq=False)
class Surface:
    """Points of a surface.

    Attributes
    ----------
    points, normals : (n, 3) array of float
        Unit normals, away from the solid as well as can be told.
    spacing : float
        The side of the square each point stands for, in the data's unit.
    noise : float
        Median distance of points to the planes of their neighbors.
    smooth : (n, 3) array of float
        The points on those planes: three times less noise, and a bend that both surfaces share.
    fine : (2, n, 3) array of float, optional
        The points and normals of surfaces of second degree through the neighbors: less noise, and hardly a bend.
    gaps : (n,) array of float, optional
        How far each point is from the neighbor `AMONG`.
    """

    points: Array
    normals: Array
    spacing: float
    noise: float
    smooth: Array
    fine: Array | None = None
    gaps: Array | None = None

    def __len__(self) -> int:
        return len(self.points)

    @property
    def extent(self) -> float:
        """Length of the diagonal of the points' box."""
        return float(norm(np.ptp(self.points, axis=0)))

    @cached_property
    def planes(self) -> Array:
        """(n, 6) points and normals side by side: what is read together lies together."""
        return np.hstack([self.points, self.normals])

    @property
    def area(self) -> float:
        """About the area of what was seen, in the data's unit squared."""
        return len(self.points) * self.spacing**2

    def placed(self, middle: Array, unit: float) -> Surface:
        """Return the surface with a point for zero and a length for one."""
        fine = None if self.fine is None else np.stack([(self.fine[0] - middle) / unit, self.fine[1]])
        return Surface(
            (self.points - middle) / unit, self.normals, self.spacing / unit, self.noise / unit,
            (self.smooth - middle) / unit, fine,
        )  # fmt: skip

    def smoothed(self) -> Surface:
        """Return the surface with its points on the planes of their neighbors."""
        return Surface(self.smooth, self.normals, self.spacing, SMOOTHED * self.noise, self.smooth)

    def drawn(self) -> Surface:
        """Return the surface with its points on surfaces of second degree through their neighbors, if these are known.

        Both surfaces may be smoothed so though their points are not alike dense: planes would bend them differently.
        """
        return self if self.fine is None else replace(self, points=self.fine[0], normals=self.fine[1])

    def some(self, count: int, rng: np.random.Generator) -> NDArray[np.int64]:
        """Return which points to take, at most so many, at random."""
        if len(self.points) <= count:
            return np.arange(len(self.points))
        return np.sort(rng.choice(len(self.points), count, replace=False))


def surface_of(
    data: Any, name: str, *, level: float | None = None, label: int | None = None, inside: str = "above",
    poses: ArrayLike | None = None, most: int = MOST_POINTS, fine: bool = True,
) -> Surface:  # fmt: skip
    """Return the surface of any data, or say what is wrong with it; without its fine points unless they are wanted.

    Raises
    ------
    ValueError, TypeError, OSError

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = surface_of(sm.sphere(12).vertices, "source")
    >>> len(ball), bool((dot(ball.points, ball.normals) > 0.9).all()), bool(abs(ball.area / (4 * np.pi) - 1) < 0.1)
    (2880, True, True)
    """
    if isinstance(data, str | os.PathLike):
        data = as_data(data, name)
    try:
        subject = as_subject(
            data,
            level=level,
            label=label,
            inside=inside if isinstance(data, Volume) else "above",
            components="all",
            poses=poses,
        )
    except (ValueError, TypeError) as error:
        kind = type(error) if isinstance(error, TypeError | TopologyError) else ValueError
        said = str(error).removeprefix("data ")
        raise kind(f"{name} {said}" if said != str(error) else f"{name}: {error}") from None
    known: Array | None = None
    if isinstance(subject, PointsSubject):
        points, known = subject.cloud.points, subject.cloud.normals
    elif isinstance(subject, TrianglesSubject):
        points, known = subject.sampled.points, subject.sampled.normals
    else:
        points = subject.points
    first = distinct(points)[0]
    points, known = points[first], None if known is None else known[first]
    if len(points) < FEWEST_POINTS:
        raise ValueError(f"{name} must hold at least {FEWEST_POINTS} points to be registered, not {len(points)}")
    extents = np.linalg.svd(points - points.mean(axis=0), full_matrices=False, compute_uv=False)
    if not extents[1] > THINNEST * extents[0]:
        raise ValueError(f"{name} must be points on a surface to be registered; they lie on a line")
    if len(points) > most:
        chosen = np.sort(np.random.default_rng(0).choice(len(points), most, replace=False))
        points, known = points[chosen], None if known is None else known[chosen]
    spacing, noise, near = neighbors_of(points)
    normals, _, smooth = _planes_of(points, near)
    if known is not None:
        normals = np.where(dot(normals, known)[:, None] < 0, -normals, normals)
    else:
        normals = oriented(points, Planes(normals, spacing, noise))
    drawn = np.empty((2, len(points), 3)) if fine else None
    if drawn is not None:
        _kernels_planes.fit_quadrics(points, near, normals, *drawn)
    gaps = norm(points[near[:, AMONG - 1]] - points)
    return Surface(points, normals, spacing, noise, smooth, drawn, gaps)


def comparable(source: Surface, target: Surface) -> None:
    """Refuse surfaces of which one is hardly larger than the gaps between the other's points.

    Raises
    ------
    ValueError
    """
    apart, size = max(source.spacing, target.spacing), min(source.extent, target.extent)
    if apart > ALIKE * size:
        raise ValueError(
            f"source and target must be in one unit: points of the larger are {apart:.3g} apart, and the smaller is "
            f"{size:.3g} long in all"
        )


def neighbors_of(points: Array) -> tuple[float, float, NDArray[np.int64]]:
    """Return spacing, noise, and the neighbors (n, k) of points, each first its own.

    Sixteen neighbors, or forty where the noise is more than a fourth of the spacing.
    """
    tree = cKDTree(points)
    few = min(FEW, len(points))
    some = points if len(points) <= MEASURED else points[:: len(points) // MEASURED]
    distance, near = tree.query(some, k=few, workers=-1)
    spacing = float(np.median(distance[:, -1])) * np.sqrt(np.pi / few)
    noise = float(np.sqrt(np.median(_planes_of(points, near)[1])))
    count = few if noise < NOISY * spacing else min(MANY, len(points))
    if count > few or some is not points:
        _, near = tree.query(points, k=count, workers=-1)
    return spacing, noise, near


def _planes_of(points: Array, near: NDArray[np.int64]) -> tuple[Array, Array, Array]:
    """Return normals (m, 3), mean squared distances (m,) of neighbors (m, k) to their planes, the first on them."""
    out = np.empty((len(near), 3)), np.empty(len(near)), np.empty((len(near), 3))
    _kernels_planes.fit_planes(points, near, *out)
    return out


def oriented(points: Array, found: Planes) -> Array:
    """Return the normals (n, 3) of planes turned out of the body that points bound, or of the shell they are.

    Seen from the middle of a shell's border, or of a body, normals in the mean look away.
    """
    some, planes = points, found
    if len(points) > TURNED_POINTS:
        some = points[np.sort(np.random.default_rng(0).choice(len(points), TURNED_POINTS, replace=False))]
        spacing, noise, near = neighbors_of(some)
        planes = Planes(_planes_of(some, near)[0], spacing, noise)
    cell = float(np.ptp(points, axis=0).max()) / CELLS
    inward = oriented_indicator(some, planes, cell).at(points)[1]
    normals = np.where(dot(found.normals, inward)[:, None] > 0, -found.normals, found.normals)
    border = border_of_points(some[:: max(1, len(some) // BORDERING)])
    middle = border.points.mean(axis=0) if len(border.points) else points.mean(axis=0)
    return normals if sense(points, normals, middle) >= -STRAIGHT else -normals
