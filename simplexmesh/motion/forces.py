"""Names of the internal constraints, and user-supplied forces: functions from a `Frame` to displacements."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check
from simplexmesh._vec import norm

Array = NDArray[np.float64]

CONSTRAINTS = ("free", "orientation", "angle", "mean_curvature", "shape", "curvature")
"""Constraints of the internal force at a vertex, by rising order of continuity (Delingette 1994, section 4.3).

==================  =============================================================================================
``free``            none along the normal: vertices are spaced evenly, normals may be discontinuous
``orientation``     continuous normals, simplex angle 0; shrinks closed surfaces
``angle``           the mean simplex angle of the vertices within `rigidity` edges
``mean_curvature``  the mean H of the vertices within `rigidity` edges; a sphere is at rest
``shape``           the simplex angle and metric parameters of a reference mesh: elastic shape memory, at any scale
``curvature``       a prescribed mean curvature
==================  =============================================================================================

On the rim of a hole, `free` keeps the curvature of the rim as a line, `orientation` straightens it, `shape` restores
the position relative to the surrounding vertices on the reference, and the other three give continuous curvature.

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
    iteration : int
    """

    vertices: Array
    normals: Array
    neighbors: NDArray[np.int32]
    mean_curvature: Array
    iteration: int


Force = Callable[[Frame], Array]
"""A function from a `Frame` to the displacement (n, 3) it adds to every vertex in this iteration."""


def constraint_codes(constraint: str | ArrayLike, count: int) -> NDArray[np.int8]:
    """Return one code per vertex, the index in `CONSTRAINTS`, from a name, an array of names or of codes.

    Examples
    --------
    >>> constraint_codes(["free", "shape"], 2)
    array([0, 4], dtype=int8)
    """
    names = np.asarray(constraint)
    if names.dtype.kind == "O" and all(isinstance(name, str) for name in names.ravel()):
        names = names.astype(str)
    if names.dtype.kind in "US":
        for name in np.unique(names):
            _check.choice("constraint", str(name), CONSTRAINTS)
        if names.shape not in ((), (count,)):
            raise ValueError(f"constraint must have shape ({count},), not {names.shape}")
        known, place = np.unique(names, return_inverse=True)
        codes = np.array([CONSTRAINTS.index(str(name)) for name in known])[np.broadcast_to(place.ravel(), (count,))]
    else:
        codes = _check.indices("constraint", names, (count,), len(CONSTRAINTS))
    return np.array(codes, dtype=np.int8)


def as_forces(forces: Any) -> tuple[Force, ...]:
    """Return one force or a sequence of forces as a tuple, checked.

    Examples
    --------
    >>> as_forces(3.0)
    Traceback (most recent call last):
    ...
    TypeError: forces must be a function of a Frame or a sequence of them, not float
    """
    if callable(forces):
        return (forces,)
    try:
        out = tuple(forces)
    except TypeError:
        raise TypeError(
            f"forces must be a function of a Frame or a sequence of them, not {type(forces).__name__}"
        ) from None
    for k, force in enumerate(out):
        if not callable(force):
            raise TypeError(f"forces must be functions of a Frame; forces[{k}] is a {type(force).__name__}")
    return out


def total_displacement(forces: tuple[Force, ...], frame: Frame) -> Array:
    """Return the sum (n, 3) of the displacements of all forces."""
    out = np.zeros(frame.vertices.shape)
    for force in forces:
        out += _check.array("a force's displacements", force(frame), out.shape)
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
    goal = _check.array("point", point, (3,))
    vertex = _check.integer("vertex", vertex, 0)
    stiffness = _check.number("stiffness", stiffness, 0, 1)
    extent = _check.number("extent", extent, 0, open_low=True)

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
    middle = _check.array("center", center, (3,))
    radius = _check.number("radius", radius, 0, open_low=True)
    strength = _check.number("strength", strength, 0, 1)

    def force(frame: Frame) -> Array:
        away = frame.vertices - middle
        distance = norm(away)
        depth = np.clip(radius - distance, 0.0, None)
        return strength * away * np.divide(depth, distance, out=np.zeros_like(depth), where=distance > 0)[:, None]

    return force
