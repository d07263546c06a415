"""Names of the internal constraints, and user-supplied forces: functions from a `Frame` to displacements."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices32
from simplexmesh._base.vectors import norm

CONSTRAINTS = ("free", "orientation", "angle", "mean_curvature", "shape", "curvature")
"""Constraints of the internal force at a vertex, by rising order of continuity (Delingette 1994, section 4.3).

==================  =============================================================================================
``free``            none along the normal: vertices are spaced evenly, normals may be discontinuous
``orientation``     continuous normals, simplex angle 0; shrinks closed surfaces
``angle``           the mean simplex angle of the vertices within `rigidity` edges
``mean_curvature``  the mean H, `sphere_curvature`, of the vertices within `rigidity` edges; a sphere is at rest
``shape``           the simplex angle and metric parameters of a reference mesh: elastic shape memory, at any scale
``curvature``       a prescribed H
==================  =============================================================================================

On the boundary, `free` keeps the curvature of the hole's outline as a line, `orientation` straightens it, `shape`
restores the position relative to the vertices around it on the reference, and the others give continuous curvature.

Two simplex angles have the same H. The one below pi/2 is meant, unless the vertex and its three neighbors all have
angles beyond it already, of the sign of H: so a tetrahedron is at rest, and a spike is not.
"""


@dataclass(frozen=True)
class Frame:
    """The state of the mesh passed to a force: read-only views, valid for this iteration only.

    Attributes
    ----------
    vertices, normals : (n, 3) array of float
    neighbors : (n, 3) array of int
    mean_curvature : (n,) array of float
        Of the sphere through each vertex and its neighbors.
    iteration : int
    """

    vertices: Array
    normals: Array
    neighbors: Indices32
    mean_curvature: Array
    iteration: int


Force = Callable[[Frame], Array]
"""A function from a `Frame` to the displacement (n, 3) it adds to every vertex in this iteration."""


def total_displacement(forces: tuple[Force, ...], frame: Frame) -> Array:
    """Return the sum (n, 3) of the displacements of all forces."""
    out = np.zeros(frame.vertices.shape)
    for force in forces:
        out += checks.array("a force's displacements", force(frame), out.shape)
    return out


def pull(point: ArrayLike, *, vertex: int, stiffness: float = 0.2, extent: float) -> Force:
    """Return an elastic force that pulls a vertex and its neighborhood to a point (thesis, section 5.3.1).

    Parameters
    ----------
    point : (3,) array_like
        In the mesh's unit.
    vertex : int
        The vertex that is pulled.
    stiffness : float
        Fraction of the distance covered in one iteration, 0 to 1.
    extent : float
        Standard deviation of the Gaussian weight with distance from the vertex, in the mesh's unit.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.sphere(4)
    >>> model = sm.DeformableModel(ball, forces=[pull([0, 0, 2], vertex=0, extent=0.3)])
    """
    goal = checks.array("point", point, (3,))
    vertex = checks.integer("vertex", vertex, 0)
    stiffness = checks.number("stiffness", stiffness, 0, 1)
    extent = checks.number("extent", extent, 0, open_low=True)

    def force(frame: Frame) -> Array:
        vertices = frame.vertices
        if vertex >= len(vertices):
            raise ValueError(f"vertex must be one of the mesh's, 0 to {len(vertices) - 1}, not {vertex}")
        weight = np.exp(-0.5 * (norm(vertices - vertices[vertex]) / extent) ** 2)
        return stiffness * weight[:, None] * (goal - vertices[vertex])

    return force


def repulsion(center: ArrayLike, *, radius: float, strength: float = 0.2) -> Force:
    """Return a force out of a ball, proportional to the depth of a vertex in it ("virtual hand").

    Parameters
    ----------
    center : (3,) array_like
    radius : float
        In the mesh's unit.
    strength : float
        Fraction of the depth covered in one iteration, 0 to 1.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> model = sm.DeformableModel(sm.sphere(4), forces=[repulsion([1, 0, 0], radius=0.4)])
    """
    middle = checks.array("center", center, (3,))
    radius = checks.number("radius", radius, 0, open_low=True)
    strength = checks.number("strength", strength, 0, 1)

    def force(frame: Frame) -> Array:
        away = frame.vertices - middle
        distance = norm(away)
        depth = np.clip(radius - distance, 0.0, None)
        return strength * away * np.divide(depth, distance, out=np.zeros_like(depth), where=distance > 0)[:, None]

    return force
