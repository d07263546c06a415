"""Fit a quasi-regular sphere to points, repeatably and independently of their pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simplexmesh._base.arrays import Array, Mask
from simplexmesh._base.errors import DivergedError
from simplexmesh._base.vectors import cross, norm
from simplexmesh.data.points import PointCloud
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.model.deform import DeformableModel
from simplexmesh.motion.model.forces import CONSTRAINTS
from simplexmesh.motion.model.state import mean_edge
from simplexmesh.motion.reconstruct.outer_side import are_inward
from simplexmesh.motion.start.primitives import primitive_around, principal_frame
from simplexmesh.motion.targets.borders import border_of_points
from simplexmesh.motion.targets.points import Points
from simplexmesh.motion.targets.protocol import Target
from simplexmesh.numerics.plane_fits import planes
from simplexmesh.orientation.poisson import oriented_indicator
from simplexmesh.recognition.register.oriented_points import drawn_rows
from simplexmesh.recognition.sai.sphere_domain import mobius_centering, mobius_map, sphere_domain

MOST_POINTS = 10_000
"""Number of points the sphere is fitted to, drawn at random; more change it by less than the mesh resolves."""

CURVATURE, ORIENTATION = (np.int8(CONSTRAINTS.index(name)) for name in ("mean_curvature", "orientation"))
"""Constraints of vertices: continuous mean curvature, but continuous orientation where there is no data and the surface
is concave or has left the data's box. A film of continuous curvature would go on bulging there and never converge."""

MAXIMUM_GROWTH = 1.25
"""Largest ratio of the area after a phase to the least before; a film without data that has come loose only grows."""

COARSE_FREQUENCY, CHECK_EVERY = 4, 10


@dataclass(frozen=True)
class Phase:
    """Parameters of one phase of the fit, as in `DeformableModel`; the reach is in half diagonals of the data's box."""

    rigidity: int
    reach: float
    iterations: int
    beta: float
    damping: float
    tolerance: float = 5e-4
    alpha: float = 0.4
    centered: bool = False


# Strong smoothing first, then light; little damping, since the slowest part is the tangential motion of vertices to
# metric parameters of 1/3. A `centered` phase ends with the conformal map that centers the area.
COARSE_PHASES = (
    Phase(9, 2.0, 100, 0.03, 0.6, 1e-2, 0.5),
    Phase(5, 0.8, 60, 0.05, 0.6, 1e-2, 0.5),
    Phase(3, 0.4, 100, 0.1, 0.4, 5e-3),
    Phase(1, 0.2, 300, 0.2, 0.3, centered=True),
)
FINE_PHASES = (
    Phase(3, 0.16, 100, 0.2, 0.3, 2e-3),
    Phase(1, 0.16, 250, 0.3, 0.2, centered=True),
    *3 * (Phase(1, 0.10, 200, 0.4, 0.2, centered=True),),
    Phase(1, 0.10, 100, 0.4, 0.5),
)


def fit_sphere(points: Array, normals: Array | None, frequency: int) -> SimplexMesh:
    """Return the sphere of a frequency fitted to points, its area centered."""
    cloud = facing_outward(points, normals)
    target = Points(cloud)
    box = Box.around(points)
    start = primitive_around(cloud.points, "ellipsoid", 20 * COARSE_FREQUENCY**2)
    mesh = sphere_domain(COARSE_FREQUENCY).mesh.moved(start.vertices)
    for phase in COARSE_PHASES:
        mesh = _run_phase(mesh, COARSE_FREQUENCY, target, phase, box, frequency if phase.centered else COARSE_FREQUENCY)
    area = np.inf
    for phase in FINE_PHASES:
        try:
            moved = _run_phase(mesh, frequency, target, phase, box, frequency)
        except DivergedError:
            continue  # a film without data, which little damping lets oscillate; the last phase has more
        if moved.area > MAXIMUM_GROWTH * area:
            break
        mesh, area = moved, min(area, moved.area)
    if np.isinf(area):
        raise DivergedError("no phase of the fit of the sphere came to rest", mesh)
    return mesh


def _run_phase(
    mesh: SimplexMesh, frequency: int, target: Target, phase: Phase, box: Box, target_frequency: int
) -> SimplexMesh:
    """Return the mesh after a phase, on the sphere of `target_frequency`."""
    model = DeformableModel(
        mesh, target, rigidity=phase.rigidity, reach=phase.reach * box.radius, alpha=phase.alpha, beta=phase.beta,
        damping=phase.damping,
    )  # fmt: skip
    limit, before = phase.tolerance * CHECK_EVERY * mean_edge(mesh), mesh.vertices
    for iteration in range(1, phase.iterations + 1):
        gaps = model.step()
        if iteration % CHECK_EVERY == 0:
            now = model.mesh
            free = np.isnan(gaps)
            bulging = (now.sphere_curvature < 0) | box.outside(now.vertices)
            model.constraint = np.where(free & bulging, ORIENTATION, CURVATURE)
            model.damping = np.where(free, 0.6, phase.damping)  # vertices without data would oscillate
            if norm(now.vertices - before).max() <= limit:
                break
            before = now.vertices
    if not phase.centered:
        return mesh.moved(model.mesh.vertices)
    return centered(mesh.moved(model.mesh.vertices), frequency, target_frequency)


@dataclass(frozen=True, eq=False)
class Box:
    """The bounding box of the data along its principal axes."""

    center: Array
    axes: Array
    half_sides: Array
    radius: float

    @staticmethod
    def around(points: Array) -> Box:
        """Return the bounding box of points (m, 3)."""
        center, axes = principal_frame(points)
        half_sides = np.abs((points - center) @ axes.T).max(axis=0)
        return Box(center, axes, half_sides, 0.5 * float(norm(np.ptp(points, axis=0))))

    def outside(self, points: Array) -> Mask:
        """Return a mask (k,) of the points outside the box."""
        return np.asarray((np.abs((points - self.center) @ self.axes.T) > self.half_sides).any(axis=1))


def vertex_areas(mesh: SimplexMesh) -> Array:
    """Return (n,) areas of the triangles of each vertex's neighbors: on regular hexagons, of its dual cell."""
    a, b, c = np.moveaxis(mesh.vertices[mesh.neighbors], 1, 0)
    return 0.5 * norm(cross(b - a, c - a))


def centered(mesh: SimplexMesh, frequency: int, target_frequency: int) -> SimplexMesh:
    """Return a sphere resampled so that its area, mapped to the round sphere, is balanced about the center."""
    before, after = sphere_domain(frequency), sphere_domain(target_frequency)
    steps = mobius_centering(before.vertices, vertex_areas(mesh))
    directions = after.vertices
    for b in reversed(steps):
        directions = mobius_map(directions, -b)
    directions = directions / norm(directions)[:, None]
    return after.mesh.moved(before.interpolated(mesh.vertices, before.locate(directions)))


def facing_outward(points: Array, normals: Array | None) -> PointCloud:
    """Return at most `MOST_POINTS` of the points, with rough outward normals of the body or shell they sample."""
    rng = np.random.default_rng(0)
    rows = drawn_rows(len(points), MOST_POINTS, rng)
    chosen, normals = points[rows], None if normals is None else normals[rows]
    subset = chosen[drawn_rows(len(chosen), MOST_POINTS // 2, rng)]
    if normals is None:
        cell = float(np.ptp(chosen, axis=0).max()) / 40
        normals = -oriented_indicator(subset, planes(subset), cell).at(chosen)[1]
        length = norm(normals)
        known = length > 0
        chosen, normals = chosen[known], normals[known] / length[known, None]
    border = border_of_points(subset)
    center = border.points.mean(axis=0) if len(border.points) else chosen.mean(axis=0)
    return PointCloud(chosen, -normals if are_inward(chosen, normals, center) else normals)
