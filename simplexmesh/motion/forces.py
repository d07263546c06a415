"""Internal constraints by name, and forces of the user's own: plain functions from a `Frame` to displacements."""

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
"""What the internal force of a vertex asks for, by rising order of continuity (Delingette 1994, section 4.3).

==================  =============================================================================================
``free``            nothing across the surface: normals may break, only vertices even out
``orientation``     a flat neighborhood: continuous normals; shrinks closed surfaces
``angle``           the mean simplex angle of the vertices within `rigidity` edges
``mean_curvature``  the mean H of the vertices within `rigidity` edges; a sphere is at rest
``shape``           the simplex angle and metric parameters of a reference mesh: elastic shape memory, at any scale
``curvature``       a prescribed mean curvature
==================  =============================================================================================

On the rim of a hole, a line, `free` keeps the line's curvature, `orientation` asks for a straight one, `shape` for the
place among the vertices around that the reference has, the three others for continuous curvature along the line.

Two angles have the same H. The one below a right angle is meant, unless the vertex and its three neighbors are all
beyond it already, to the side of the H wanted: so a tetrahedron is at rest, and a spike is not.
"""


@dataclass(frozen=True)
class Frame:
    """What a force may look at: the moving mesh, as read-only views that hold for this iteration only.

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
    """Return one code per vertex (the place in `CONSTRAINTS`) from a name, names or codes.

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


def several(forces: Any) -> tuple[Force, ...]:
    """Return one force or several as a tuple.

    Examples
    --------
    >>> several(3.0)
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


def pushed(forces: tuple[Force, ...], frame: Frame) -> Array:
    """Return the sum (n, 3) of the displacements that forces ask for."""
    out = np.zeros(frame.vertices.shape)
    for force in forces:
        out += _check.array("a force's displacements", force(frame), out.shape)
    return out


def pull(point: ArrayLike, *, vertex: int, stiffness: float = 0.2, extent: float) -> Force:
    """Return an elastic force that draws a vertex and its surroundings to a point (thesis, section 5.3.1).

    Parameters
    ----------
    point : (3,) array_like
        Where to draw, in the mesh's unit.
    vertex : int
        The vertex taken hold of.
    stiffness : float
        Share of the distance covered in one iteration, 0 to 1.
    extent : float
        Distance from the vertex at which the force has fallen to 1/e^(1/2), in the mesh's unit.

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
    """Return a force that keeps the surface out of a ball, stronger the deeper a vertex is in it ("virtual hand").

    Parameters
    ----------
    center : (3,) array_like
    radius : float
        In the mesh's unit.
    strength : float
        Share of the depth covered in one iteration, 0 to 1.

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
