"""Shrink-wrapping: a mesh around the data is pressed on to it, and films over what is hollow into each other.

Far from the data a mesh has nothing to look for along its normals. A film under tension, pressed inwards, comes to all
of it, however concave, and stops where it meets another film of the same mesh: across a tunnel.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh._vec import dot, norm, normalized
from simplexmesh.mesh.face_geometry import face_centroids
from simplexmesh.mesh.face_sizing import resized_faces
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.contact import contacts
from simplexmesh.motion.deform import DeformableModel
from simplexmesh.motion.forces import CONSTRAINTS, Frame
from simplexmesh.motion.state import Target
from simplexmesh.motion.walls import Walls

Array = NDArray[np.float64]

GRADE = 0.15
"""Edges are about this part of the distance to the data, where that is far."""

NEAR = 1.5
"""Data counts as near within so many edges."""

STRAIGHT = 0.8
"""Normals around a vertex are as long as that in the mean, or it is on the edge of a flap."""

CLEAR = 0.3
"""In edges: so far above data the edge of a flap is beside it, not on it."""

FACING = 0.4
"""Smallest cosine between the normals of a vertex that sits on the data and of the data there."""

ROUND = 8
"""Iterations between two rounds of evening the sizes of faces."""

FILM, SKIN = CONSTRAINTS.index("orientation"), CONSTRAINTS.index("mean_curvature")


def grown(marked: NDArray[np.bool_], neighbors: NDArray[np.int32], rings: int) -> NDArray[np.bool_]:
    """Return the marked vertices and those within so many edges of one."""
    for _ in range(rings):
        marked = marked | marked[neighbors].any(axis=1)
    return marked


@dataclass(frozen=True, eq=False)
class Samples:
    """Points on the surface wanted, with unit normals.

    Attributes
    ----------
    points, normals : (m, 3) array of float
    oriented : bool
        Whether the normals point outwards, or either way.
    genus : int, optional
        How many handles the data has, when it says so.
    walls : Walls, optional
        What tells which lines run around the data's tunnels, when it is known.
    what : str
        How a sentence on the genus begins.
    target : Target, optional
        A surface that stands for points too few to tell one.
    """

    points: Array
    normals: Array
    oriented: bool
    genus: int | None = None
    walls: Walls | None = None
    target: Target | None = None
    what: str = "the surface has"

    def area(self, neighbors: int = 8) -> float:
        """Return about how large the surface is, from how far apart its points are.

        Examples
        --------
        >>> import simplexmesh as sm
        >>> ball = sm.sphere(16)
        >>> bool(abs(Samples(ball.vertices, ball.normals, oriented=True).area() / ball.area - 1) < 0.1)
        True
        """
        away = cKDTree(self.points).query(self.points, k=min(neighbors + 1, len(self.points)))[0][:, -1]
        return float((np.pi * away**2 / neighbors).sum())


class Wrapping:
    """A mesh being wrapped around data.

    Parameters
    ----------
    mesh : SimplexMesh
        Around the data, closed.
    samples : Samples
    vertices : int
        About how many it will have when it lies on the data; far away they are fewer.

    Attributes
    ----------
    mesh : SimplexMesh
        As it is now.
    edge : float
        The length of an edge on the data.
    free : (n,) array of bool
        Which vertices of `mesh` do not sit on data.
    meets : (n,) array of int
        For each free vertex the one that it meets across a film's inside, -1 when none.
    close : (n,) array of bool
        Which vertices have data near, whether they sit on it or not.
    complete : bool
        Whether all handles around a cavity are there: films that still meet are two sides of flaps, which retract.
    """

    def __init__(self, mesh: SimplexMesh, samples: Samples, vertices: int) -> None:
        self.mesh = SimplexMesh(mesh.vertices, mesh.connectivity)
        self.samples = samples
        self._tree = cKDTree(samples.points)
        self._area = max(samples.area(), np.finfo(float).tiny) / (vertices / 2)
        self.edge = float(np.sqrt(2 * self._area / (3 * np.sqrt(3))))
        spacing = self._tree.query(samples.points, k=min(2, len(samples.points)))[0][:, -1]
        self._near = max(NEAR * self.edge, 2 * float(np.median(spacing)))
        self._looks = 0
        self.complete = False
        self._look(self.mesh.vertices, self.mesh.normals, self.mesh.neighbors)

    def run(self, iterations: int, *, press: bool = True, watch: Callable[[SimplexMesh], None] | None = None) -> None:
        """Press for so many iterations; `watch` sees the mesh after every `ROUND` of them.

        Without `press` all of it is under tension and drawn to the data nearby, so that folds come undone.

        Raises
        ------
        DivergedError
            When a vertex flies off.
        """
        self._pressing = press
        for start in range(0, iterations, ROUND):
            self.mesh = self._evened()
            self._looks = 0
            self._look(self.mesh.vertices, self.mesh.normals, self.mesh.neighbors)
            model = DeformableModel(self.mesh, rigidity=2, damping=1.0, forces=self._push)
            for _ in range(start, min(start + ROUND, iterations)):
                slack = self.free | self._folded | np.full(len(self.free), not press)
                code = np.where(slack, FILM, SKIN).astype(np.int8)
                code.setflags(write=False)
                model.constraint = code
                model.alpha[:] = np.where(self.close & ~self._folded, 0.1 if press else 0.3, 0.4)
                model.step()
            self.mesh = SimplexMesh(model.mesh.vertices, model.mesh.connectivity)
            if watch is not None:
                watch(self.mesh)
        self._look(self.mesh.vertices, self.mesh.normals, self.mesh.neighbors)

    def aim(self, vertices: int) -> None:
        """Even out towards so many vertices from now on, whatever the area of the data was thought to be."""
        self._area *= self.mesh.n_vertices / vertices

    def took(self, mesh: SimplexMesh) -> None:
        """Go on with another mesh, edited from the last one."""
        self.mesh = SimplexMesh(mesh.vertices, mesh.connectivity)
        self._look(mesh.vertices, mesh.normals, mesh.neighbors)

    def _evened(self) -> SimplexMesh:
        c = self.mesh.connectivity
        away = self._tree.query(face_centroids(self.mesh.vertices, c.face_vertices, c.face_offsets))[0]
        return resized_faces(self.mesh, self._area * np.maximum(1.0, GRADE * away / self.edge) ** 2).mesh

    def _look(self, vertices: Array, normals: Array, neighbors: NDArray[np.int32]) -> None:
        """Find the data nearest to each vertex, who sits on it, and which films meet."""
        self._away, self._nearest = self._tree.query(vertices, workers=-1)
        facing = dot(normals, self.samples.normals[self._nearest])
        self.close = self._away < self._near
        self.free = ~(self.close & (np.abs(facing) > FACING))
        self._folded = self.close & (facing < -FACING) if self.samples.oriented else np.zeros(len(vertices), bool)
        self._edges = norm(vertices[neighbors] - vertices[:, None]).mean(axis=1)
        self.meets, self._depth = contacts(vertices, normals, self._edges, np.flatnonzero(self.free))

    def _push(self, frame: Frame) -> Array:
        """Return the displacements: on to the data nearby, inwards where there is none, apart where films meet."""
        V, N = frame.vertices, frame.normals
        if self._looks % 2:
            self._look(V, N, frame.neighbors)
        self._looks += 1
        out = np.zeros_like(V)
        across = self.samples.normals[self._nearest]
        height = dot(V - self.samples.points[self._nearest], across)
        toward = -height[:, None] * across
        out[self.close] = 0.6 * toward[self.close]
        if not self._pressing:
            return out
        smooth = N + N[frame.neighbors].sum(axis=1)
        smooth = smooth + smooth[frame.neighbors].sum(axis=1)
        bent = norm(smooth) < 16 * STRAIGHT
        smooth = normalized(smooth)
        press = -(0.03 * self._away + 0.04 * self.edge)[:, None] * smooth
        along = press - dot(press, across)[:, None] * across
        press = np.where(self.close[:, None], along, press)  # along data, never through it
        met = self.meets >= 0
        flap = met & self.complete
        met &= ~(flap & bent)  # the edge of a flap is free to retract
        held = met | grown(met & ~flap, frame.neighbors, 2)  # or two films would slide over each other
        out[self.free & ~held] += press[self.free & ~held]
        if self.complete:  # the edge of a flap beside data that it looks at from inside: away from it
            loose = self._folded & (height > CLEAR * self._edges) & ~met & grown(flap, frame.neighbors, 3)
            out[loose] = -0.15 * self._edges[loose, None] * smooth[loose]
        apart = 0.2 * np.clip(0.6 * self._edges - self._depth, 0.0, 0.5 * self._edges)
        out[met] += apart[met, None] * smooth[met]
        return out
