"""Conditions on contours of a model: where they are, how they bend, and how the surface meets them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices
from simplexmesh._base.errors import TopologyError
from simplexmesh._base.vectors import dot, norm, normalized
from simplexmesh.mesh.connectivity import MAX_VERTICES
from simplexmesh.mesh.contours import Contour
from simplexmesh.mesh.decimation.certified import Surface
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.model._kernels_contours import Shapes
from simplexmesh.motion.model._kernels_step import Frames, Moving, Step

CONTINUITIES = {"free": "free", "normal": "orientation", "curvature": "mean_curvature"}
"""Of `smooth`, and the constraint of the model that each is."""


FREE_SHAPE = Shapes(np.array(np.nan), np.array(np.nan), np.zeros(3))
"""Nothing is prescribed."""


@dataclass(frozen=True, eq=False, repr=False)
class Condition:
    """A condition on a contour, made by `pinned`, `crease` or `smooth`.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> sm.pinned(sm.Contour.of_face(sm.sphere(4), 0))
    pinned(Contour(6 vertices))
    """

    contour: Contour | str
    _shape: Shapes | None = None  # None if it does not move by a force of its own
    sharp: bool = False
    continuity: str | None = None
    pinned: bool = False
    at: Indices | None = None  # those pinned, if not all
    _curve: Surface | None = None  # where they are pinned, if not where they start
    tangent: Array | None = None
    mean_curvature: Array | None = None

    def __repr__(self) -> str:
        kind = "pinned" if self.pinned else "crease" if self.sharp else "smooth"
        return f"{kind}({self.contour!r})"

    @property
    def rank(self) -> int:
        """The order in which conditions of one contour are applied: the last prescribes its shape."""
        return 0 if self.sharp else 1 if self.pinned else 2

    def on(self, mesh: SimplexMesh) -> Condition:
        """Return the condition with its contour as one of a mesh, checked to be on it."""
        if isinstance(self.contour, str):
            if self.contour not in (named := mesh.contours):
                raise ValueError(f"contours must be those of the mesh, {sorted(named)}, not {self.contour!r}")
            found = named[self.contour]
        elif not np.array_equal(self.contour.mesh.connectivity.twin, mesh.connectivity.twin):
            raise TopologyError(f"contours must be on the model's mesh, {self.contour!r} is on another")
        else:
            found = Contour(mesh, self.contour.vertices, self.contour.closed)
        if self.at is not None and (other := np.setdiff1d(self.at, found.vertices)).size:
            raise ValueError(f"at must be vertices of the contour; {other[0]} is not on it")
        shape = FREE_SHAPE if self._shape is None else self._shape
        given = {"curvature": shape.curvature, "torsion": shape.torsion}
        for name, values in {**given, "tangent": self.tangent, "mean_curvature": self.mean_curvature}.items():
            if values is not None and values.shape not in ((), (len(found),)):
                raise ValueError(f"{name} must have shape ({len(found)},), one for each vertex, not {values.shape}")
        return replace(self, contour=found)

    @property
    def line(self) -> Contour:
        """The contour of a condition that is on a mesh."""
        assert isinstance(self.contour, Contour)
        return self.contour

    @property
    def rows(self) -> Indices:
        """The vertices that it is about, of a condition that is on a mesh."""
        return self.line.vertices if self.at is None else self.at

    def prescribe(self, vertices: Array, frames: Frames) -> None:
        """Set the curvature of the surface that its averages take at the contour, and leave creases out of them."""
        rows = self.line.vertices
        if self.sharp:
            frames.area[rows] = 0.0
        if self.mean_curvature is not None:
            frames.curvature[rows] = self.mean_curvature
        if self.tangent is not None:
            inner = slice(None) if self.line.closed else slice(1, -1)
            frames.curvature[rows[inner]] = self._of_tangent(vertices, frames, inner)

    def _of_tangent(self, vertices: Array, frames: Frames, inner: slice) -> Array:
        """Return the curvature sin(Theta0 - Theta) / r of inner vertices, negated where the surface is on the right."""
        whole, mesh = self.line.vertices, self.line.mesh
        back, rows, ahead = np.roll(whole, 1)[inner], whole[inner], np.roll(whole, -1)[inner]
        places, normals = vertices[rows], frames.normals[rows]
        along = normalized(vertices[ahead] - vertices[back])
        away = places - 0.5 * (vertices[back] + vertices[ahead])
        outward = np.cross(along, self._shape.plane) if self._shape is not None and self._shape.plane.any() else away
        outward = normalized(outward - dot(outward, along)[:, None] * along)
        angle = np.arctan2(dot(along, np.cross(outward, normals)), dot(outward, normals))
        around = mesh.neighbors[rows]
        third = around.sum(axis=1) - back - ahead
        left = dot(vertices[third] - places, np.cross(normals, along)) > 0
        wanted = np.broadcast_to(np.asarray(self.tangent), len(whole))[inner]
        short = (wanted - angle + np.pi) % (2 * np.pi) - np.pi
        sine = np.sin(np.clip(short, -np.pi / 2, np.pi / 2))
        known = (outward != 0).any(axis=1)
        return np.where(known, np.where(left, sine, -sine) * frames.inverse_radius[rows], frames.curvature[rows])

    def place(self, motion: Moving, out: Step) -> None:
        """Put what is pinned in its place, or on its curve: by at most half the way to its neighbors in a step."""
        if not self.pinned:
            return
        rows = self.rows
        goals = self.line.mesh.vertices[rows] if self._curve is None else self._curve.closest(out.positions[rows])[1]
        step = goals - motion.vertices[rows]
        edges = motion.vertices[motion.neighbors[rows]] - motion.vertices[rows][:, None]
        reach = 0.5 * np.sqrt((edges**2).sum(axis=(1, 2)) / 3)
        length = norm(step)
        step *= np.divide(reach, length, out=np.ones(len(length)), where=length > reach)[:, None]
        out.positions[rows] = motion.vertices[rows] + step
        out.moves[rows] = dot(step, step)


def pinned(contour: Contour | str, curve: Any = None, *, at: ArrayLike | None = None) -> Condition:
    """Return the condition that a contour of a model, or some of its vertices, are in a place.

    Parameters
    ----------
    contour : Contour or str
        A contour of the model's mesh, or its name.
    curve : (k, 3) array, or object with `points` and `closed`, optional
        The polyline to whose nearest points the contour is drawn, and on which its vertices space themselves evenly; it
        must lie around the contour as seen from it, or only a part of it is reached. An array is of a closed one if its
        last point is the first. Default: every vertex stays where it is at the start.
    at : (m,) array of int, optional
        The vertices of the mesh that are pinned; default: all of the contour.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> tube = sm.cylinder(24, 8)
    >>> top, bottom = sm.Contour.of_holes(tube)
    >>> turn = np.linspace(0, 2 * np.pi, 200)
    >>> wide = np.stack([2 * np.cos(turn), 2 * np.sin(turn), np.ones(200)], axis=1)
    >>> model = sm.DeformableModel(tube, contours=[sm.pinned(top, wide), sm.pinned(bottom)])
    >>> for state in model.run(60):
    ...     pass
    >>> bool(abs(np.linalg.norm(model.mesh.vertices[top.vertices, :2], axis=1) - 2).max() < 1e-3)
    True
    """
    rows = None if at is None else checks.indices("at", at, (None,), MAX_VERTICES)
    if rows is not None and not len(rows):
        raise ValueError("at must be at least one vertex, not none")
    if curve is None:
        return Condition(_contour(contour), pinned=True, at=rows)
    points = checks.array("curve", getattr(curve, "points", curve), (None, 3))
    if len(points) < 2 or not np.ptp(points, axis=0).any():
        raise ValueError("curve must have at least 2 different points")
    if getattr(curve, "closed", False):
        points = np.concatenate([points, points[:1]])
    at = np.arange(len(points) - 1)
    segments = Surface(points, np.stack([at, at + 1, at + 1], axis=1))
    return Condition(_contour(contour), FREE_SHAPE, pinned=True, at=rows, _curve=segments)


def crease(contour: Contour | str) -> Condition:
    """Return the condition that a surface is continuous at a contour, its normals not (C0).

    Averages of curvature stop there, and the contour is free to bend unless another condition, `smooth`, applies too.

    Parameters
    ----------
    contour : Contour or str
        A contour of the model's mesh, or its name.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.sphere(6)
    >>> x, y, _ = ball.vertices.T
    >>> equator = sm.Contour.through(ball, [x.argmax(), y.argmax(), x.argmin(), y.argmin()])
    >>> model = sm.DeformableModel(ball, contours=sm.crease(equator))
    """
    return Condition(_contour(contour), FREE_SHAPE, sharp=True, continuity="free")


def smooth(
    contour: Contour | str, *, continuity: str = "curvature", curvature: float | ArrayLike | None = None,
    torsion: float | ArrayLike | None = None, plane: ArrayLike | None = None,
    tangent: float | ArrayLike | None = None, mean_curvature: float | ArrayLike | None = None,
) -> Condition:  # fmt: skip
    """Return the condition that a contour is a smooth line, and how the surface meets it.

    The contour moves as a 1-simplex mesh (Delingette 1994, 4.8), not with the surface, which sees of it what `tangent`
    or `mean_curvature` say. Ends of open contours move with the surface, unless they are pinned. All but `plane` are a
    number, or one for each vertex.

    Parameters
    ----------
    contour : Contour or str
        A contour of the model's mesh, or its name.
    continuity : {"curvature", "normal", "free"}
        What is continuous along it; "normal" straightens it, "free" spaces its vertices evenly only.
    curvature : float or (k,) array, optional
        Its curvature, in the inverse of the mesh's unit, at least 0 without a plane. A contour that is straight knows
        no side to bend to: give `plane`. Default: the mean over its neighbors.
    torsion : float or (k,) array, optional
        The torsion angle psi of (3.17), in radians: by how much the line leaves the frame of the edges before and
        after. With 0 torsion is uniform, as of helices and plane curves. Default: that of the mean curvature vector
        of its neighbors.
    plane : (3,) array, optional
        Normal of a plane: its frame (3.8) is used instead of that of space. Curvature has a sign then, positive on a
        contour that runs counter-clockwise around a convex region, seen from the tip of the normal.
    tangent : float or (k,) array, optional
        The angle Theta, in radians, from the normal of the contour, which points from its chord to the vertex (with a
        plane: out of a counter-clockwise contour), to that of the surface, about the direction of the contour (4.10).
    mean_curvature : float or (k,) array, optional
        Mean curvature of the surface at the contour, positive where it is convex. Give this or `tangent`.

    Examples
    --------
    A cap that meets the plane of its rim at 45 degrees:

    >>> import numpy as np, simplexmesh as sm
    >>> disk = sm.plane(12, 12)
    >>> (rim,) = sm.Contour.of_holes(disk)
    >>> cap = sm.smooth(rim.reversed(), tangent=-np.pi / 4)
    >>> model = sm.DeformableModel(disk, contours=[sm.pinned(rim), cap])
    """
    checks.choice("continuity", continuity, tuple(CONTINUITIES))
    if continuity != "curvature" and not (curvature is None and torsion is None and plane is None):
        raise ValueError(f"curvature, torsion and plane are for continuity='curvature', not {continuity!r}")
    if torsion is not None and plane is not None:
        raise ValueError("torsion is for contours in space: give it or plane, not both")
    if tangent is not None and mean_curvature is not None:
        raise ValueError("give tangent or mean_curvature, not both")
    normal = np.zeros((1, 3)) if plane is None else normalized(checks.array("plane", plane, (3,))[None])
    if plane is not None and not normal.any():
        raise ValueError("plane must be a normal of some length, not zero")
    shape = Shapes(_numbers("curvature", curvature), _angles("torsion", torsion), normal[0])
    if plane is None and (shape.curvature < 0).any():
        raise ValueError("curvature has a sign in a plane only: give plane, or a curvature of at least 0")
    return Condition(
        _contour(contour), shape, continuity=continuity,
        tangent=None if tangent is None else _angles("tangent", tangent),
        mean_curvature=None if mean_curvature is None else _numbers("mean_curvature", mean_curvature),
    )  # fmt: skip


def conditions_on(mesh: SimplexMesh, given: Condition | Sequence[Condition]) -> list[Condition]:
    """Return conditions, on a mesh, in the order in which they are applied."""
    found = [given] if isinstance(given, Condition | Contour) else list(given)
    for condition in found:
        checks.instance("contours", condition, Condition)
    placed = sorted((condition.on(mesh) for condition in found), key=lambda condition: condition.rank)
    for k, one in enumerate(placed):
        for other in placed[k + 1 :]:
            if one.rank == other.rank and np.isin(one.rows, other.rows).sum() > 2:  # contours may end on others
                raise ValueError(f"contours must not give two conditions of a kind, as {one!r} and {other!r} are")
    return placed


def _contour(given: Contour | str) -> Contour | str:
    """Return what must be a contour or a name."""
    return given if isinstance(given, str) else checks.instance("contour", given, Contour)


def _angles(name: str, value: float | ArrayLike | None) -> Array:
    """Return angles in radians, from -pi to pi, as `_numbers` does."""
    out = _numbers(name, value)
    if (np.abs(out) > np.pi).any():
        most = np.nanmax(np.abs(out))
        raise ValueError(f"{name} must be in radians, -pi to pi, not {most:g}: numpy.radians converts degrees")
    return out


def _numbers(name: str, value: float | ArrayLike | None) -> Array:
    """Return a number, or one for each vertex, as an array; NaN for None."""
    if value is None:
        return np.array(np.nan)
    return np.array(checks.number(name, value)) if np.ndim(value) == 0 else checks.array(name, value, (None,))
