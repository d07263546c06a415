"""Shrink-wrapping: a mesh that encloses the data is pressed on to it under tension.

Far from the data, a search along normals finds nothing. A film under tension and inward pressure reaches all of a
concave surface, and stops where it meets another film of the same mesh: across a tunnel.
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
from simplexmesh.motion.tunnel_homology import TunnelHomology
from simplexmesh.motion.zones import dilated

Array = NDArray[np.float64]

GRADE = 0.15
"""Edge length relative to the distance to the data, where that is large."""

NEAR = 1.5
"""In edges: data within this distance is near."""

MIN_MEAN_NORMAL = 0.8
"""Length of the mean normal around a vertex, below which it is on the edge of a flap."""

MIN_CLEARANCE = 0.3
"""In edges: height above the data from which on the edge of a flap is not on it."""

FACING = 0.4
"""Smallest cosine between the normals of a vertex on the data and of the data there."""

ROUND = 8
"""Iterations between rounds of evening face sizes."""

FILM, ON_DATA = CONSTRAINTS.index("orientation"), CONSTRAINTS.index("mean_curvature")


@dataclass(frozen=True, eq=False)
class Samples:
    """Points on a closed surface, with unit normals and what is known of its topology.

    Attributes
    ----------
    points, normals : (m, 3) array of float
    oriented : bool
        Whether the normals point outwards; otherwise their signs are arbitrary.
    genus : int, optional
        Genus of the data, if known.
    homology : TunnelHomology, optional
        Homology of the data's surface, if known, to tell which lines run around its tunnels.
    what : str
        Beginning of messages about the genus.
    target : Target, optional
        A surface to fit in place of the data, if its points are few.
    """

    points: Array
    normals: Array
    oriented: bool
    genus: int | None = None
    homology: TunnelHomology | None = None
    target: Target | None = None
    what: str = "the surface has"

    def area(self, neighbors: int = 8) -> float:
        """Return an estimate of the area of the surface from the density of the points.

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
    """A mesh in the course of shrink-wrapping.

    Parameters
    ----------
    mesh : SimplexMesh
        A closed mesh that encloses the data.
    samples : Samples
    vertices : int
        Approximate number when it is on the data; farther away there are fewer.

    Attributes
    ----------
    mesh : SimplexMesh
        The present mesh.
    edge : float
        Edge length on the data.
    free : (n,) array of bool
        Whether a vertex of `mesh` is not on data.
    meets : (n,) array of int
        For each free vertex the one it meets, back to back, across the inside of the mesh; -1 for none.
    near_data : (n,) array of bool
        Whether a vertex has data nearby, on it or not.
    complete : bool
        Whether all handles around a cavity exist, so that films that still meet are the sides of flaps, to retract.
    """

    def __init__(self, mesh: SimplexMesh, samples: Samples, vertices: int) -> None:
        self.mesh = SimplexMesh(mesh.vertices, mesh.connectivity)
        self.samples = samples
        self._tree = cKDTree(samples.points)
        self._area = max(samples.area(), np.finfo(float).tiny) / (vertices / 2)
        self.edge = float(np.sqrt(2 * self._area / (3 * np.sqrt(3))))
        spacing = self._tree.query(samples.points, k=min(2, len(samples.points)))[0][:, -1]
        self._near_distance = max(NEAR * self.edge, 2 * float(np.median(spacing)))
        self._evaluations = 0
        self.complete = False
        self._update_contacts(self.mesh.vertices, self.mesh.normals, self.mesh.neighbors)

    def run(self, iterations: int, *, press: bool = True, watch: Callable[[SimplexMesh], None] | None = None) -> None:
        """Iterate; `watch` is called with the mesh after every `ROUND` iterations.

        Without `press`, all of the mesh is under tension and attracted to data nearby, which removes folds.

        Raises
        ------
        DivergedError
            When the motion diverges.
        """
        self._pressing = press
        for start in range(0, iterations, ROUND):
            self.mesh = self._evened()
            self._evaluations = 0
            self._update_contacts(self.mesh.vertices, self.mesh.normals, self.mesh.neighbors)
            model = DeformableModel(self.mesh, rigidity=2, damping=1.0, forces=self._push)
            for _ in range(start, min(start + ROUND, iterations)):
                slack = self.free | self._folded | np.full(len(self.free), not press)
                code = np.where(slack, FILM, ON_DATA).astype(np.int8)
                code.setflags(write=False)
                model.constraint = code
                model.alpha[:] = np.where(self.near_data & ~self._folded, 0.1 if press else 0.3, 0.4)
                model.step()
            self.mesh = SimplexMesh(model.mesh.vertices, model.mesh.connectivity)
            if watch is not None:
                watch(self.mesh)
        self._update_contacts(self.mesh.vertices, self.mesh.normals, self.mesh.neighbors)

    def set_target_count(self, vertices: int) -> None:
        """Rescale the target face area so that evening leads to this number of vertices."""
        self._area *= self.mesh.n_vertices / vertices

    def replace_mesh(self, mesh: SimplexMesh) -> None:
        """Continue with an edited mesh."""
        self.mesh = SimplexMesh(mesh.vertices, mesh.connectivity)
        self._update_contacts(mesh.vertices, mesh.normals, mesh.neighbors)

    def _evened(self) -> SimplexMesh:
        c = self.mesh.connectivity
        away = self._tree.query(face_centroids(self.mesh.vertices, c.face_vertices, c.face_offsets))[0]
        return resized_faces(self.mesh, self._area * np.maximum(1.0, GRADE * away / self.edge) ** 2).mesh

    def _update_contacts(self, vertices: Array, normals: Array, neighbors: NDArray[np.int32]) -> None:
        """Find the nearest data of each vertex, the vertices that are on it, and the contacts of films."""
        self._away, self._nearest = self._tree.query(vertices, workers=-1)
        facing = dot(normals, self.samples.normals[self._nearest])
        self.near_data = self._away < self._near_distance
        self.free = ~(self.near_data & (np.abs(facing) > FACING))
        self._folded = self.near_data & (facing < -FACING) if self.samples.oriented else np.zeros(len(vertices), bool)
        self._edges = norm(vertices[neighbors] - vertices[:, None]).mean(axis=1)
        self.meets, self._depth = contacts(vertices, normals, self._edges, np.flatnonzero(self.free))

    def _push(self, frame: Frame) -> Array:
        """Return the displacements: to data nearby, inwards where there is none, apart where films meet."""
        V, N = frame.vertices, frame.normals
        if self._evaluations % 2:
            self._update_contacts(V, N, frame.neighbors)
        self._evaluations += 1
        out = np.zeros_like(V)
        across = self.samples.normals[self._nearest]
        height = dot(V - self.samples.points[self._nearest], across)
        toward = -height[:, None] * across
        out[self.near_data] = 0.6 * toward[self.near_data]
        if not self._pressing:
            return out
        smooth = N + N[frame.neighbors].sum(axis=1)
        smooth = smooth + smooth[frame.neighbors].sum(axis=1)
        bent = norm(smooth) < 16 * MIN_MEAN_NORMAL
        smooth = normalized(smooth)
        press = -(0.03 * self._away + 0.04 * self.edge)[:, None] * smooth
        along = press - dot(press, across)[:, None] * across
        press = np.where(self.near_data[:, None], along, press)  # tangential near data, never through it
        meeting = self.meets >= 0
        flap = meeting & self.complete
        meeting &= ~(flap & bent)  # the edge of a flap is free to retract
        held = meeting | dilated(meeting & ~flap, frame.neighbors, 2)  # keeps films from sliding over each other
        out[self.free & ~held] += press[self.free & ~held]
        if self.complete:  # the edge of a flap above data, with opposed normals: away from it
            loose = self._folded & (height > MIN_CLEARANCE * self._edges) & ~meeting & dilated(flap, frame.neighbors, 3)
            out[loose] = -0.15 * self._edges[loose, None] * smooth[loose]
        apart = 0.2 * np.clip(0.6 * self._edges - self._depth, 0.0, 0.5 * self._edges)
        out[meeting] += apart[meeting, None] * smooth[meeting]
        return out
