"""Gaps between two parts: how far each is from the other, and how a small motion of one changes that."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simplexmesh._vec import cross, dot, norm
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.motion.targets.triangles import Triangles

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

OPPOSED = -0.3
"""Surfaces meet where the cosine between their normals is less."""


class Part:
    """A surface, the area around each of its vertices, and distances to it.

    Parameters
    ----------
    mesh : TriangleMesh
        Its vertices keep their rows; distances are to the surface with equal positions merged.
    """

    def __init__(self, mesh: TriangleMesh) -> None:
        self.points, self.normals, self.diagonal = mesh.vertices, mesh.vertex_normals, mesh.diagonal
        self.areas = np.bincount(mesh.faces.ravel(), np.repeat(norm(mesh.face_vectors) / 6, 3), len(mesh.vertices))
        whole = mesh.welded(report=False)
        self.surface, self.closed = Triangles(whole), whole.is_closed

    def known(self, points: Array) -> tuple[Array, Array]:
        """Return signed distances to the surface, NaN beyond its border, and the directions they grow in."""
        distance, direction, beyond = self.surface.signed(points)
        return np.where(beyond, np.nan, distance), direction


class Gaps(NamedTuple):
    """Distances between two parts, and how they change.

    Attributes
    ----------
    distance : (m,) array of float
        At vertices of either part that are near the other.
    rows : (m, 6) array of float
        By which a small turn about `middle`, in arms, and a shift of the moving part change them.
    area : (m,) array of float
        What each stands for where surfaces face each other, otherwise 0; the moving part's vertices only.
    middle : (3,) array of float
    arm : float
        Root mean square distance of the vertices to the middle.
    mine, its : (k,) array of int
        Which vertices of the moving part, and of the fixed one.
    """

    distance: Array
    rows: Array
    area: Array
    middle: Array
    arm: float
    mine: Indices
    its: Indices


def gaps(
    one: Part, other: Part, T: Array, reach: float, behind: float, among: tuple[Indices, Indices] | None = None
) -> Gaps:
    """Return the distances between a part, moved, and another, where they are at most `reach`.

    Parameters
    ----------
    one, other : Part
        The moving one and the fixed one.
    T : (4, 4) array of float
        Where the moving part is.
    reach : float
    behind : float
        What is farther than this on the other side of an open surface is not inside of anything.
    among : pair of arrays of int, optional
        Look at these vertices of either only.
    """
    R, t = T[:3, :3], T[:3, 3]
    mine, its = among or (np.arange(len(one.points)), np.arange(len(other.points)))
    at, there = one.points[mine] @ R.T + t, other.points[its]
    distance, away = other.known(at)
    back, inward = one.known((there - t) @ R)
    close = within(distance, reach, np.inf if other.closed else behind)
    met = within(back, reach, np.inf if one.closed else behind)
    where = np.vstack([at[close], there[met]])
    way = np.vstack([away[close], -inward[met] @ R.T])
    area = np.where(dot(one.normals[mine] @ R.T, away) < OPPOSED, one.areas[mine], 0.0)[close]
    middle = where.mean(axis=0) if len(where) else t
    arm = max(float(np.sqrt(((where - middle) ** 2).sum(axis=1).mean())) if len(where) else 1.0, 1e-300)
    rows = np.hstack([cross((where - middle) / arm, way), way])
    both = np.concatenate([distance[close], back[met]])
    return Gaps(both, rows, np.append(area, np.zeros(int(met.sum()))), middle, arm, mine[close], its[met])


def within(distance: Array, reach: float, behind: float) -> NDArray[np.bool_]:
    """Return which signed distances are known, at most `reach`, and at least -`behind`."""
    with np.errstate(invalid="ignore"):
        return np.asarray((distance <= reach) & (distance >= -behind))
