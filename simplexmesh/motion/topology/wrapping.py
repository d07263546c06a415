"""Wrapping: a closed mesh shrinks onto a surface that it encloses, and films across tunnels are joined to handles.

Delingette, thesis, 1994, sections 5.4.1 and 5.4.2. There the user brings the films over both ends of a tunnel close
together; here pressure does.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices, Indices32
from simplexmesh._base.vectors import dot, norm, normalized
from simplexmesh.mesh.check import tangled_vertices
from simplexmesh.mesh.face_geometry import face_centroids
from simplexmesh.mesh.operators.editable_mesh import EditableMesh
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.density.face_edits import divide_faces
from simplexmesh.motion.model.deform import DeformableModel
from simplexmesh.motion.model.forces import CONSTRAINTS, Frame
from simplexmesh.motion.topology.face_regions import dilated, face_components
from simplexmesh.motion.topology.handles import HandleProposal, add_handles
from simplexmesh.motion.topology.holes import open_holes, refusal

FILM, ON_SURFACE = CONSTRAINTS.index("orientation"), CONSTRAINTS.index("mean_curvature")

NEAR = 1.5
"""In edges: a vertex within this distance of the surface is attracted by it."""

FACING = 0.4
"""Smallest cosine between the normals of a vertex on the surface and of the surface there."""

GRADE = 0.15
"""Edge length relative to the distance to the surface, where that is large."""

ROUND, TURN, MOST_TURNS = 8, 16, 40
"""Iterations between rounds of evening face sizes, and between tests for rest; tests until wrapping is given up."""

LARGE, SMALL, MERGED = 1.7, 0.45, 1.3
"""In target areas: faces above `LARGE` are divided; those below `SMALL` are merged if the result is below `MERGED`."""

DISTANCE, DIFFERENCE, ANGLE = 1.5, 0.6, float(np.radians(60.0))
"""Of `add_handles`, for openings that are not at their final places yet."""


def contacts(vertices: Array, normals: Array, edges: Array, rows: NDArray[np.integer]) -> tuple[Indices, Array]:
    """Return the shallowest vertex (n,) opposed and within two `edges` (n,) behind some, -1 for none, and its depth."""
    meets, depth = np.full(len(vertices), -1), np.zeros(len(vertices))
    if not len(rows):
        return meets, depth
    length = edges[rows]
    behind = vertices[rows] - 0.8 * length[:, None] * normals[rows]
    near = cKDTree(vertices).query_ball_point(behind, 1.2 * length, workers=-1)
    counts = np.array([len(found) for found in near])
    mine = np.repeat(rows, counts)
    other = np.concatenate([np.asarray(found, np.int64) for found in near])
    offset = vertices[other] - vertices[mine]
    along = -np.einsum("ij,ij->i", offset, normals[mine])
    lateral = np.sqrt(np.maximum(np.einsum("ij,ij->i", offset, offset) - along**2, 0.0))
    opposed = np.einsum("ij,ij->i", normals[other], normals[mine]) < -0.3
    valid = np.flatnonzero(opposed & (along > -0.4 * edges[mine]) & (lateral < 0.9 * edges[mine]))
    valid = valid[np.lexsort((-other[valid], -along[valid]))]  # the shallowest is written last, of equals the first
    meets[mine[valid]], depth[mine[valid]] = other[valid], along[valid]
    return meets, depth


@dataclass(frozen=True, eq=False)
class Wrapped:
    """A wrapped mesh, or the surface itself, `replaced`, where that fails; and the pairs of films that met."""

    mesh: SimplexMesh
    proposals: tuple[HandleProposal, ...]
    replaced: bool = False


def wrapped(
    start: SimplexMesh,
    surface: SimplexMesh,
    *,
    vertices: int,
    accept: Callable[[HandleProposal], Any] | None = None,
    watch: Callable[[SimplexMesh], None] | None = None,
) -> Wrapped:
    """Return a mesh wrapped around a surface that it encloses, with its handles; with `accept` some may lack."""
    wrapping = Wrapping(start, surface, vertices)
    ask = _Decisions(accept)
    proposals: list[HandleProposal] = []
    free: list[int] = []
    left = MOST_TURNS
    while left and not _is_steady(free):
        wrapping.run(TURN, watch=watch)
        left = min(left - 1, 5 if ask.refused else left)  # films that are to stay are not pressed forever
        free.append(int(wrapping.free.sum()))
        joined = _films_joined(wrapping, ask) if wrapping.mesh.genus < surface.genus else None
        if joined is not None:
            wrapping.replace_mesh(joined[0])
            proposals.append(joined[1])
            free, left = [], MOST_TURNS
    wrapping.relax(vertices, watch)
    if accept is None and not wrapping.is_complete:
        return Wrapped(surface, (), replaced=True)
    return Wrapped(wrapping.mesh, (*proposals, *ask.refused))


def _is_steady(counts: list[int]) -> bool:
    """Return whether the number of free vertices varied by less than 3 % in the last five turns."""
    recent = counts[-5:]
    return len(recent) == 5 and max(recent) - min(recent) <= 0.03 * max(*recent, 50)


class Wrapping:
    """A mesh in the course of wrapping; `free` (n,) marks its vertices that are not on the surface."""

    def __init__(self, mesh: SimplexMesh, surface: SimplexMesh, vertices: int) -> None:
        self.surface = surface
        self._tree = cKDTree(surface.vertices)
        self._face_area = surface.area / (vertices / 2)
        self.edge = float(np.sqrt(2 * self._face_area / (3 * np.sqrt(3))))
        self.replace_mesh(mesh)

    def replace_mesh(self, mesh: SimplexMesh) -> None:
        """Continue with another mesh."""
        self.mesh = SimplexMesh(mesh.vertices, mesh.connectivity)
        self._update(mesh.vertices, mesh.normals, mesh.neighbors)

    def relax(self, vertices: int, watch: Callable[[SimplexMesh], None] | None = None) -> None:
        """Iterate without pressure, which removes folds, towards a number of vertices."""
        for _ in range(3):
            self._face_area *= self.mesh.n_vertices / vertices
            self.run(TURN, press=False, watch=watch)

    def run(self, iterations: int, *, press: bool = True, watch: Callable[[SimplexMesh], None] | None = None) -> None:
        """Iterate; without `press`, all of the mesh is under tension and attracted where the surface is near."""
        self._pressing = press
        for start in range(0, iterations, ROUND):
            self.replace_mesh(self._evened())
            self._evaluations = 0
            model = DeformableModel(self.mesh, rigidity=2, damping=1.0, forces=self._push)
            for _ in range(start, min(start + ROUND, iterations)):
                slack = self.free | self._folded | np.full(len(self.free), not press)
                model.constraint = np.where(slack, FILM, ON_SURFACE).astype(np.int8)
                model.alpha[:] = np.where(self._near & ~self._folded, 0.1 if press else 0.3, 0.4)
                model.step()
            self.replace_mesh(model.mesh)
            if watch is not None:
                watch(self.mesh)

    @property
    def is_complete(self) -> bool:
        """Whether the mesh is untangled, on the surface, of its genus, and reaches all of it."""
        if self.mesh.genus != self.surface.genus or self.mesh.n_components != 1 or self.free.any():
            return False
        missed = cKDTree(self.mesh.vertices).query(self.surface.vertices)[0] > 2 * self.edge
        return not missed.any() and not tangled_vertices(self.mesh).any()

    def _evened(self) -> SimplexMesh:
        c = self.mesh.connectivity
        away = self._tree.query(face_centroids(self.mesh.vertices, c.face_vertices, c.face_offsets))[0]
        return resized_faces(self.mesh, self._face_area * np.maximum(1.0, GRADE * away / self.edge) ** 2)

    def _update(self, vertices: Array, normals: Array, neighbors: Indices32) -> None:
        """Find the nearest place of each vertex on the surface, the vertices that are on it, and those that meet."""
        self._away, self._nearest = self._tree.query(vertices, workers=-1)
        facing = dot(normals, self.surface.normals[self._nearest])
        self._near = self._away < NEAR * self.edge
        self.free = ~(self._near & (np.abs(facing) > FACING))
        self._folded = self._near & (facing < -FACING)
        edges = norm(vertices[neighbors] - vertices[:, None]).mean(axis=1)
        self.meets, depth = contacts(vertices, normals, edges, np.flatnonzero(self.free))
        self._apart = 0.2 * np.clip(0.6 * edges - depth, 0.0, 0.5 * edges)

    def _push(self, frame: Frame) -> Array:
        """Return the displacements: to the surface nearby, inwards where it is far, apart where films meet."""
        V, N = frame.vertices, frame.normals
        if self._evaluations % 2:
            self._update(V, N, frame.neighbors)
        self._evaluations += 1
        across = self.surface.normals[self._nearest]
        toward = -dot(V - self.surface.vertices[self._nearest], across)[:, None] * across
        out = np.where(self._near[:, None], 0.6 * toward, 0.0)
        if not self._pressing:
            return out
        smooth = N + N[frame.neighbors].sum(axis=1)
        smooth = normalized(smooth + smooth[frame.neighbors].sum(axis=1))
        press = -(0.03 * self._away + 0.04 * self.edge)[:, None] * smooth
        along = press - dot(press, across)[:, None] * across
        press = np.where(self._near[:, None], along, press)  # tangential near the surface, never through it
        meeting = self.meets >= 0
        held = dilated(meeting, frame.neighbors, 2)  # keeps films from sliding over each other
        out[self.free & ~held] += press[self.free & ~held]
        out[meeting] += self._apart[meeting, None] * smooth[meeting]
        return out


def resized_faces(mesh: SimplexMesh, target_areas: Array) -> SimplexMesh:
    """Return a mesh with faces too large for their target areas (f,) divided once (T2), too small ones merged (T1)."""
    c = mesh.connectivity
    size, solid = mesh.face_areas / target_areas, ~c.face_is_hole
    edit = EditableMesh(mesh)
    large = np.flatnonzero((size > LARGE) & (c.face_sizes >= 5) & solid)
    divide_faces(edit, mesh, large, 2 * len(large), np.ones(len(size), bool))
    small = np.flatnonzero((size < SMALL) & solid).tolist()
    edit.remove_edges([dart for face in small if (dart := _dart_to_smallest(mesh, face, size)) >= 0])
    edit.even_out()
    return edit.result().mesh


def _dart_to_smallest(mesh: SimplexMesh, face: int, size: Array) -> int:
    """Return the dart of a face towards its smallest neighbor, -1 when merging them would make it too large."""
    c = mesh.connectivity
    darts = c.face_darts[c.face_offsets[face] : c.face_offsets[face + 1]]
    other = c.face.reshape(-1)[c.twin.reshape(-1)[darts]]
    both = np.where(c.face_is_hole[other], np.inf, size[other] + size[face])
    best = int(both.argmin())
    return int(darts[best]) if both[best] < MERGED else -1


class _Decisions:
    """Calls the user's `accept` once for each place: a pair of films that is refused stays and meets again."""

    def __init__(self, accept: Callable[[HandleProposal], Any] | None) -> None:
        self._accept = accept
        self.refused: list[HandleProposal] = []

    def __call__(self, proposal: HandleProposal) -> bool | str:
        middle = proposal.centers.mean(axis=0)
        for before in self.refused:
            if norm(before.centers.mean(axis=0) - middle) < before.radii.max() + before.distance:
                return before.reason
        reason = "" if self._accept is None else refusal(self._accept(proposal))
        if reason:
            self.refused.append(replace(proposal, reason=reason))
        return reason or True


def _films_joined(
    wrapping: Wrapping, accept: Callable[[HandleProposal], Any]
) -> tuple[SimplexMesh, HandleProposal] | None:
    """Return the mesh with a handle between the two films off the surface that meet the most, and its proposal."""
    mesh, c = wrapping.mesh, wrapping.mesh.connectivity
    share = np.add.reduceat(wrapping.free[c.face_vertices].astype(float), c.face_offsets[:-1]) / c.face_sizes
    films = face_components(c, share > 0.5)
    film = np.full(len(share), -1)
    for k, faces in enumerate(films):
        film[faces] = k
    mine = film[c.vertex_faces].max(axis=1)
    met = (wrapping.meets >= 0) & (mine >= 0)
    pairs = np.stack([mine[met], mine[wrapping.meets[met]]], axis=1)
    pairs = np.sort(pairs[(pairs[:, 0] != pairs[:, 1]) & (pairs[:, 1] >= 0)], axis=1)
    pairs, counts = np.unique(pairs, axis=0, return_counts=True)
    for a, b in pairs[np.argsort(-counts, kind="stable")].tolist():
        opened = open_holes(mesh, zones=[films[a], films[b]]).mesh
        if opened.n_holes == 2 and opened.n_components == 1:
            out = add_handles(opened, gap=DISTANCE, difference=DIFFERENCE, angle=ANGLE, accept=accept)
            if out.proposals[0].accepted:
                return out.mesh, out.proposals[0]
    return None
