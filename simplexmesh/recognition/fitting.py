"""A quasi-regular sphere fitted to data until it rests, always in the same way whatever the data's pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplexmesh._vec import cross, norm
from simplexmesh.data.points import PointCloud
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.deform import DeformableModel
from simplexmesh.motion.evolve import mean_edge
from simplexmesh.motion.forces import CONSTRAINTS
from simplexmesh.motion.initial.orientation import turned
from simplexmesh.motion.initial.planes import planes
from simplexmesh.motion.initial.primitives import primitive_around, principal_frame
from simplexmesh.motion.outward import STRAIGHT, sense
from simplexmesh.motion.state import Target
from simplexmesh.motion.targets.borders import border_of_points
from simplexmesh.motion.targets.points import Points
from simplexmesh.recognition.spheres import ball, boosted, centering

Array = NDArray[np.float64]

MOST_POINTS = 10_000
"""The surface is found from so many points, chosen at random; more change it by less than the mesh can show."""

SMOOTH, TAUT = (np.int8(CONSTRAINTS.index(name)) for name in ("mean_curvature", "orientation"))
"""What vertices keep to: curvature goes on smoothly, save where there is no data and the surface is hollow or has left
the data's box. A smooth film would go on bulging there, through the body or away from it, and never rest."""

GROWTH = 1.25
FREE_DAMPING = 0.6
"""Where there is no data to hold them, vertices must not swing."""

LOOK = 10
TURNED_POINTS = 5_000
CELLS = 40
COARSE = 4


@dataclass(frozen=True)
class Phase:
    """One phase of the fit: a motion, as in `DeformableModel`, with its reach in half diagonals of the data."""

    rigidity: int
    reach: float
    iterations: int
    alpha: float
    beta: float
    damping: float
    tolerance: float
    centered: bool = False


# Strong smoothing first, then light; little damping, since what takes longest is the sliding of vertices to where
# the metric parameters are 1/3. A phase that is `centered` ends with the conformal map that centers the area.
FIRST = (
    Phase(9, 2.0, 100, 0.5, 0.03, 0.6, 1e-2),
    Phase(5, 0.8, 60, 0.5, 0.05, 0.6, 1e-2),
    Phase(3, 0.4, 100, 0.4, 0.1, 0.4, 5e-3),
    Phase(1, 0.2, 300, 0.4, 0.2, 0.3, 5e-4, centered=True),
)
THEN = (
    Phase(3, 0.16, 100, 0.4, 0.2, 0.3, 2e-3),
    Phase(1, 0.16, 250, 0.4, 0.3, 0.2, 5e-4, centered=True),
    Phase(1, 0.10, 200, 0.4, 0.4, 0.2, 5e-4, centered=True),
    Phase(1, 0.10, 200, 0.4, 0.4, 0.2, 5e-4, centered=True),
    Phase(1, 0.10, 200, 0.4, 0.4, 0.2, 5e-4, centered=True),
    Phase(1, 0.10, 100, 0.4, 0.4, 0.5, 5e-4),
)


def fitted(points: Array, normals: Array | None, frequency: int) -> SimplexMesh:
    """Return the sphere of a frequency at rest on points, its area centered.

    A sphere whose vertices are as evenly among their neighbors as they can be is nearly a conformal image of the
    round one, and so is what any conformal map of the round sphere makes of it: which of them a motion ends in hangs
    on where it began. The one is taken whose area is balanced about the center of the round sphere; up to a rotation
    there is one only, so that the same object gives the same mesh in any pose.

    Parameters
    ----------
    points : (m, 3) array of float
    normals : (m, 3) array of float or None
        Away from the solid, where they are known.
    frequency : int
        Of the sphere, that of the icosahedron; the result has its connectivity.

    Returns
    -------
    SimplexMesh

    Examples
    --------
    >>> cloud = ball(12).vertices * [2, 1, 1]
    >>> mesh = fitted(cloud, None, 5)
    >>> bool(np.abs(np.linalg.norm(mesh.vertices / [2, 1, 1], axis=1) - 1).max() < 0.05)
    True
    """
    cloud = facing_outward(points, normals)
    target = Points(cloud)
    box = Box.around(points)
    start = primitive_around(cloud.points, "ellipsoid", 20 * COARSE**2)
    mesh = ball(COARSE).mesh.moved(start.vertices)
    for phase in FIRST:
        mesh = _moved(mesh, COARSE, target, phase, box, frequency if phase.centered else COARSE)
    area = np.inf
    for phase in THEN:
        following = _moved(mesh, frequency, target, phase, box, frequency)
        if following.area > GROWTH * area:  # a film where no data is has come loose: it would only grow
            break
        mesh, area = following, min(area, following.area)
    return mesh


def _moved(mesh: SimplexMesh, frequency: int, target: Target, phase: Phase, box: Box, to: int) -> SimplexMesh:
    """Return the mesh after a phase, on the sphere of frequency `to`."""
    model = DeformableModel(
        mesh, target, rigidity=phase.rigidity, reach=phase.reach * box.radius, alpha=phase.alpha, beta=phase.beta,
        damping=phase.damping,
    )  # fmt: skip
    still, before = phase.tolerance * LOOK * mean_edge(mesh), mesh.vertices
    for iteration in range(1, phase.iterations + 1):
        gaps = model.step()
        if iteration % LOOK == 0:
            now = model.mesh
            free = np.isnan(gaps)
            bulging = (now.mean_curvature < 0) | box.left_by(now.vertices)
            model.constraint = np.where(free & bulging, TAUT, SMOOTH)
            model.damping = np.where(free, FREE_DAMPING, phase.damping)
            if norm(now.vertices - before).max() <= still:
                break
            before = now.vertices
    if not phase.centered:
        return mesh.moved(model.mesh.vertices)
    return centered(mesh.moved(model.mesh.vertices), frequency, to)


@dataclass(frozen=True, eq=False)
class Box:
    """The box around the data along its principal axes.

    Attributes
    ----------
    center : (3,) array of float
    axes : (3, 3) array of float
        As rows.
    sides : (3,) array of float
        Half the length of each side.
    radius : float
        Half the diagonal of the data's box along x, y and z.
    """

    center: Array
    axes: Array
    sides: Array
    radius: float

    @staticmethod
    def around(points: Array) -> Box:
        """Return the box around points (m, 3)."""
        center, axes = principal_frame(points)
        sides = np.abs((points - center) @ axes.T).max(axis=0)
        return Box(center, axes, sides, 0.5 * float(norm(np.ptp(points, axis=0))))

    def left_by(self, points: Array) -> NDArray[np.bool_]:
        """Return (k,) whether points are outside."""
        return np.asarray((np.abs((points - self.center) @ self.axes.T) > self.sides).any(axis=1))


def vertex_areas(mesh: SimplexMesh) -> Array:
    """Return (n,) the area of the triangle of each vertex's neighbors: on regular hexagons, what belongs to it.

    Examples
    --------
    >>> areas = vertex_areas(ball(9).mesh)
    >>> bool(abs(areas.sum() / (4 * np.pi) - 1) < 0.02)
    True
    """
    a, b, c = np.moveaxis(mesh.vertices[mesh.neighbors], 1, 0)
    return 0.5 * norm(cross(b - a, c - a))


def centered(mesh: SimplexMesh, frequency: int, to: int) -> SimplexMesh:
    """Return a mesh with the connectivity of a sphere, slid along itself so that its area is balanced on the sphere.

    Parameters
    ----------
    mesh : SimplexMesh
        With the connectivity of ``ball(frequency)``.
    frequency : int
    to : int
        The frequency of the result.

    Returns
    -------
    SimplexMesh
    """
    before, after = ball(frequency), ball(to)
    steps = centering(before.vertices, vertex_areas(mesh))
    directions = after.vertices
    for b in reversed(steps):
        directions = boosted(directions, -b)
    directions = directions / norm(directions)[:, None]
    return after.mesh.moved(before.interpolated(mesh.vertices, before.places(directions)))


def facing_outward(points: Array, normals: Array | None) -> PointCloud:
    """Return some of the points, at most `MOST_POINTS`, with rough normals out of the body or shell they are on.

    Seen from the middle of a shell's border, or of a body, normals in the mean look away.
    """
    rng = np.random.default_rng(0)
    chosen = points
    if len(points) > MOST_POINTS:
        rows = np.sort(rng.choice(len(points), MOST_POINTS, replace=False))
        chosen, normals = points[rows], None if normals is None else normals[rows]
    some = chosen
    if len(chosen) > TURNED_POINTS:
        some = chosen[np.sort(rng.choice(len(chosen), TURNED_POINTS, replace=False))]
    if normals is None:
        cell = float(np.ptp(chosen, axis=0).max()) / CELLS
        normals = -turned(some, planes(some), cell).at(chosen)[1]
        length = norm(normals)
        known = length > 0
        chosen, normals = chosen[known], normals[known] / length[known, None]
    border = border_of_points(some)
    middle = border.points.mean(axis=0) if len(border.points) else chosen.mean(axis=0)
    outward = sense(chosen, normals, middle) >= -STRAIGHT
    return PointCloud(chosen, normals if outward else -normals)
