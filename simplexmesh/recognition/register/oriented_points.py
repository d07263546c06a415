"""What is registered: points of a surface with outward normals, sampling density and noise."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.errors import TopologyError
from simplexmesh._base.units import common_unit
from simplexmesh._base.vectors import dot, norm
from simplexmesh.data.conversion import as_given
from simplexmesh.data.points import PointCloud, distinct
from simplexmesh.data.volume import Volume
from simplexmesh.motion.reconstruct.conversion import as_input
from simplexmesh.motion.reconstruct.outer_side import are_inward
from simplexmesh.motion.targets.borders import border_of_points
from simplexmesh.numerics import _kernels_local_fits
from simplexmesh.numerics.plane_fits import Planes, fitted, spacing_within
from simplexmesh.numerics.rigid import relative_extents
from simplexmesh.orientation.poisson import oriented_indicator

MOST_POINTS = 40_000
"""Larger data is subsampled at random; more points do not improve the pose within its covariance."""

FEWEST_POINTS = 50
FEW_NEIGHBORS, MANY_NEIGHBORS, NOISE_RATIO = 16, 40, 0.25
"""Numbers of neighbors that planes are fitted to, and the ratio of noise to spacing from which many are used."""

SUBSET, ORIENTED = 2_000, 4_000
"""Points that spacing, noise and borders are estimated from, and those that are oriented together: more take longer."""


@dataclass(frozen=True, eq=False)
class OrientedPoints:
    """Points (n, 3) of a surface, with unit normals (n, 3): outward, as far as the data determines that."""

    points: Array
    normals: Array
    spacing: float  # square root of the area per point
    noise: float  # median distance of points to planes fitted to their neighbors
    smooth: Array  # (n, 3) on these planes: a third of the noise, and a bias shared by both surfaces
    fine: Array | None = None  # (2, n, 3) points and normals of fitted quadrics: less noise, and hardly any bias
    neighbor_distances: Array | None = None  # (n,) distance to the sixth neighbor
    given: bool = False  # whether the sign of the normals is that of the data, which may be wrong
    unit: str | None = None  # of the data, if that is known
    is_closed: bool = False  # whether the data is triangles without a border, all of a body

    def __len__(self) -> int:
        return len(self.points)

    @property
    def extent(self) -> float:
        """Diagonal of the bounding box of the points."""
        return float(norm(np.ptp(self.points, axis=0)))

    @property
    def area(self) -> float:
        """Approximate area of the sampled surface, in the data's unit squared."""
        return len(self.points) * self.spacing**2

    def normalized_to(self, center: Array, unit: float) -> OrientedPoints:
        """Return the surface with its origin at `center`, scaled by 1 / `unit`."""
        fine = None if self.fine is None else np.stack([(self.fine[0] - center) / unit, self.fine[1]])
        return replace(
            self, points=(self.points - center) / unit, smooth=(self.smooth - center) / unit, fine=fine,
            spacing=self.spacing / unit, noise=self.noise / unit, neighbor_distances=None, unit=None,
        )  # fmt: skip

    def on_planes(self) -> OrientedPoints:
        """Return the surface with its points projected to planes fitted to their neighbors."""
        return OrientedPoints(self.smooth, self.normals, self.spacing, 0.35 * self.noise, self.smooth)

    def on_quadrics(self) -> OrientedPoints:
        """Return the surface with its points on fitted quadrics, which unlike planes are not biased by density."""
        return self if self.fine is None else replace(self, points=self.fine[0], normals=self.fine[1])

    def flipped(self) -> OrientedPoints:
        """Return the surface with opposite normals."""
        fine = None if self.fine is None else np.stack([self.fine[0], -self.fine[1]])
        return replace(self, normals=-self.normals, fine=fine)

    def sample(self, count: int, rng: np.random.Generator) -> Indices:
        """Return the indices of at most `count` points, drawn at random."""
        return drawn_rows(len(self.points), count, rng)


def drawn_rows(count: int, most: int, rng: np.random.Generator) -> Indices:
    """Return at most so many of `count` rows, drawn at random, in their order."""
    return np.arange(count) if count <= most else np.sort(rng.choice(count, most, replace=False))


def oriented_points(
    data: Any, name: str, *, level: float | None = None, label: int | None = None, inside: str = "above",
    poses: ArrayLike | None = None, maximum: int = MOST_POINTS, fine: bool = True,
) -> OrientedPoints:  # fmt: skip
    """Return the surface of any data; without quadrics unless `fine`."""
    cloud, given, is_closed = _points_of(data, name, level=level, label=label, inside=inside, poses=poses)
    rows = distinct(cloud.points)[0]
    _check_extent(cloud.points[rows], name)
    rows = rows[drawn_rows(len(rows), maximum, np.random.default_rng(0))]
    points, known = cloud.points[rows], None if cloud.normals is None else cloud.normals[rows]
    spacing, noise, near = neighborhoods(points)
    normals, _, smooth = fitted(points, near)
    if known is not None:
        normals = np.where(dot(normals, known)[:, None] < 0, -normals, normals)
    else:
        normals = outward_normals(points, Planes(normals, smooth, spacing, noise, near))
    quadrics = np.empty((2, len(points), 3)) if fine else None
    if quadrics is not None:
        _kernels_local_fits.fit_quadrics(len(near), points, near, normals, *quadrics)
    neighbor_distances = norm(points[near[:, 5]] - points)
    return OrientedPoints(
        points, normals, spacing, noise, smooth, quadrics, neighbor_distances, given, cloud.unit, is_closed
    )  # fmt: skip


def oriented_pair(
    source: Any, target: Any, level: Any, label: Any, inside: Any
) -> tuple[OrientedPoints, OrientedPoints]:
    """Return the surfaces of two data; level, label and inside are pairs, or of those of the two that are volumes."""
    things = {"source": source, "target": target}
    for name, given in things.items():
        if not isinstance(given, list | tuple):
            with _called(name):
                things[name] = as_given(given, name)
    words = {"level": (level, None), "label": (label, None), "inside": (inside, "above")}
    pairs = {word: _pair(word, *values, list(things.values())) for word, values in words.items()}
    one, other = (
        oriented_points(given, name, **{word: pair[k] for word, pair in pairs.items()})
        for k, (name, given) in enumerate(things.items())
    )
    return one, other


def _pair(name: str, value: Any, default: Any, things: list[Any]) -> tuple[Any, Any]:
    """Return the values for source and target: a pair, or one for the volumes among them; for both if none is one."""
    if not isinstance(value, tuple | list):
        volumes = [isinstance(each, Volume) for each in things]
        value = [value if is_volume or not any(volumes) else default for is_volume in volumes]
    if len(value) != 2:
        raise ValueError(f"{name} must be one or a pair (source, target), not {len(value)} of them")
    return value[0], value[1]


@contextmanager
def _called(name: str) -> Iterator[None]:
    """Let errors call the data by the name of an argument."""
    try:
        yield
    except (ValueError, TypeError) as error:
        kind = type(error) if isinstance(error, TypeError | TopologyError) else ValueError
        message = str(error)
        if not message.startswith(name):
            message = f"{name} {message[5:]}" if message.startswith("data ") else f"{name}: {message}"
        raise kind(message) from None


def _points_of(data: Any, name: str, **options: Any) -> tuple[PointCloud, bool, bool]:
    """Return points on any data, with its unit and any normals; whether these are unchecked, and it is closed."""
    with _called(name):
        found = as_input(data, components="all", **options)
    cloud = found.samples()
    unchecked = cloud.normals is not None and not found.oriented
    return replace(cloud, unit=found.source.unit), unchecked, getattr(found.source, "is_closed", False)


def _check_extent(points: Array, name: str) -> None:
    """Require enough points that are not collinear."""
    if len(points) < FEWEST_POINTS:
        raise ValueError(f"{name} must hold at least {FEWEST_POINTS} points to be registered, not {len(points)}")
    if relative_extents(points)[1] < 1e-3:
        raise ValueError(f"{name} must be points on a surface to be registered; they lie on a line")


def check_units(source: OrientedPoints, target: OrientedPoints) -> None:
    """Require two surfaces in one unit: neither may be smaller than about the other's point spacing."""
    common_unit("source and target", (source, target))
    spacing, size = max(source.spacing, target.spacing), min(source.extent, target.extent)
    if spacing > 0.5 * size:
        raise ValueError(
            f"source and target must be in one unit: points of the larger are {spacing:.3g} apart, and the extent of "
            f"the smaller is {size:.3g}"
        )


def neighborhoods(points: Array) -> tuple[float, float, Indices]:
    """Return spacing, noise, and the nearest neighbors (n, k) of points, each itself first; more if noisy."""
    tree = cKDTree(points)
    few = min(FEW_NEIGHBORS, len(points))
    sample = points if len(points) <= SUBSET else points[:: len(points) // SUBSET]
    distance, near = tree.query(sample, k=few, workers=-1)
    spacing = spacing_within(distance[:, -1], few)
    noise = float(np.sqrt(np.median(fitted(points, near)[1])))
    count = few if noise < NOISE_RATIO * spacing else min(MANY_NEIGHBORS, len(points))
    if count > few or sample is not points:
        _, near = tree.query(points, k=count, workers=-1)
    return spacing, noise, near


def outward_normals(points: Array, found: Planes) -> Array:
    """Return the normals (n, 3) of planes, oriented outward from the body or shell that the points sample."""
    sample, planes = points, found
    if len(points) > ORIENTED:
        sample = points[drawn_rows(len(points), ORIENTED, np.random.default_rng(0))]
        spacing, noise, near = neighborhoods(sample)
        normals, _, smooth = fitted(sample, near)
        planes = Planes(normals, smooth, spacing, noise, near)
    cell = float(np.ptp(points, axis=0).max()) / 32
    inward = oriented_indicator(sample, planes, cell).at(points)[1]
    normals = np.where(dot(found.normals, inward)[:, None] > 0, -found.normals, found.normals)
    return -normals if are_inside_out(points, normals, sample) else normals


def are_inside_out(points: Array, normals: Array, sample: Array) -> bool:
    """Whether normals point to the center of the border that a sample of the points has, or of the points."""
    border = border_of_points(sample[:: max(1, len(sample) // SUBSET)])
    center = border.points.mean(axis=0) if len(border.points) else points.mean(axis=0)
    return are_inward(points, normals, center)
