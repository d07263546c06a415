"""The flat models that signatures of other topologies live on: a torus, a tube and a round disc of hexagons."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.mesh.duality import dual
from simplexmesh.mesh.lattices import strip, subdivided, tube
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.recognition.spheres import Ball, ball, checked_frequency

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

TOPOLOGIES = ("sphere", "torus", "cylinder", "plane")
PERIODIC = {"torus": (True, True), "cylinder": (True, False), "plane": (False, False)}
RING, TUBE = 1.0, 0.35
"""Radii of the torus drawn; a tube and a disc have the radius 1."""


@dataclass(frozen=True, eq=False)
class Patch:
    """The regular mesh of a topology and frequency, and where its vertices are in the plane; made by `domain`.

    Attributes
    ----------
    topology : {"torus", "cylinder", "plane"}
    frequency : int
    mesh : SimplexMesh
        As it is drawn, about z: ``sm.torus(5 f, 2 f)``, ``sm.cylinder(5 f, 2 f - 1)``, or a disc of hexagons.
    coordinates : (n, 2) array of float
        Torus: turns around the axis and around the tube, from 0 to 1; cylinder: turns around, and the share of the
        way from one border to the other; plane: x and y in the disc of radius 1.
    """

    topology: str
    frequency: int
    mesh: SimplexMesh
    coordinates: Array

    @property
    def vertices(self) -> Array:
        """(n, 3) the vertices as drawn."""
        return self.mesh.vertices

    @cached_property
    def cell_areas(self) -> Array:
        """(n,) the part of the flat patch that belongs to each vertex; sum 4 pi, as on the sphere."""
        n = len(self.coordinates)
        share = np.ones(n)
        share[on_border(self.mesh)] = 0.5
        return 4 * np.pi * share / share.sum()

    @property
    def period(self) -> Array:
        """(2,) the width and height of a flat patch on which hexagons are regular; 1 for the disc."""
        f = self.frequency
        rows = {"torus": 2 * f, "cylinder": 2 * f - 1}
        return np.array([1.0, 1.0 if self.topology == "plane" else rows[self.topology] * np.sqrt(0.75) / (5 * f)])

    def interpolated(self, values: Array, coordinates: Array) -> Array:
        """Return values (n, ...) at places (k, 2) of the patch, (k, ...), linear in the triangles of a Delaunay."""
        corners, weights = self.places(coordinates)
        return np.asarray(np.einsum("kj,kj...->k...", weights, np.asarray(values)[corners]))

    def places(self, coordinates: Array) -> tuple[Indices, Array]:
        """Return the three vertices (k, 3) around each place of the patch, and their weights."""
        triangles, rows = self._triangles
        at = np.array(coordinates, dtype=float)
        for axis, turns in enumerate(PERIODIC[self.topology]):
            at[:, axis] = at[:, axis] % 1.0 if turns else np.clip(at[:, axis], -1.0, 1.0)
        at *= self.period
        found = triangles.find_simplex(at)
        outside = found < 0  # between a border's chord and its arc
        if outside.any():
            found[outside] = triangles.find_simplex(0.97 * at[outside] + 0.03 * self._middle)
        affine = triangles.transform[found]
        first = np.einsum("kab,kb->ka", affine[:, :2], at - affine[:, 2])
        weights = np.clip(np.column_stack([first, 1 - first.sum(axis=1)]), 0.0, None)
        return rows[triangles.simplices[found]], weights / weights.sum(axis=1, keepdims=True)

    @property
    def _middle(self) -> Array:
        return np.zeros(2) if self.topology == "plane" else 0.5 * self.period

    @cached_property
    def _triangles(self) -> tuple[Any, Indices]:
        """The Delaunay triangulation of the vertices and of copies of them one period away, and whose copies."""
        from scipy.spatial import Delaunay

        flat, rows = self.coordinates * self.period, np.arange(len(self.coordinates))
        for axis, turns in enumerate(PERIODIC[self.topology]):
            if turns:
                step = np.eye(2)[axis] * self.period
                flat, rows = np.concatenate([flat - step, flat, flat + step]), np.tile(rows, 3)
        kept = (np.abs(flat - self._middle) < 0.62 * self.period).all(axis=1) if self.topology != "plane" else rows >= 0
        return Delaunay(flat[kept]), rows[kept]


@lru_cache(maxsize=16)
def domain(topology: str, frequency: int) -> Ball | Patch:
    """Return what signatures of a topology and frequency live on, the same object every time.

    Parameters
    ----------
    topology : {"sphere", "torus", "cylinder", "plane"}
    frequency : int
        f, 5 to 12: 20 f^2 vertices, save for the disc, where they are as near to that as whole rings of hexagons come.

    Examples
    --------
    >>> [domain(name, 9).mesh.n_vertices for name in TOPOLOGIES]
    [1620, 1620, 1620, 1632]
    """
    f = checked_frequency(frequency)
    if _check.choice("topology", topology, TOPOLOGIES) == "sphere":
        return ball(f)
    return {"torus": _torus, "cylinder": _cylinder, "plane": _disc}[topology](f)


def _torus(f: int) -> Patch:
    uv, triangles = tube(5 * f, 2 * f)
    first = uv[triangles[:, 0]]
    off = uv[triangles] - first[:, None]
    at = (first + (off - np.rint(off)).mean(axis=1)) % 1.0
    mesh = dual((_on_torus(uv), triangles))
    return Patch("torus", f, mesh.moved(_on_torus(at)), at)


def _on_torus(at: Array) -> Array:
    around, across = 2 * np.pi * at.T
    reach = RING + TUBE * np.cos(across)
    return np.stack([reach * np.cos(around), reach * np.sin(around), TUBE * np.sin(across)], axis=1)


def _cylinder(f: int) -> Patch:
    uv, triangles = strip(5 * f, 2 * f - 1)
    angle = 2 * np.pi * uv[:, 0]
    mesh = dual((np.stack([np.cos(angle), np.sin(angle), uv[:, 1]], axis=1), triangles))
    x, y, height = mesh.vertices.T
    at = np.stack([np.arctan2(y, x) / (2 * np.pi) % 1.0, height], axis=1)
    angle, tall = 2 * np.pi * at[:, 0], 2 * np.pi * np.sqrt(0.75) * (2 * f - 1) / (5 * f)
    drawn = np.stack([np.cos(angle), np.sin(angle), tall * (height - 0.5)], axis=1)
    return Patch("cylinder", f, mesh.moved(drawn), at)


def _disc(f: int) -> Patch:
    """Return the dual of a hexagon of triangles, its rings made round."""
    rings = round(np.sqrt(10 / 3) * f - 0.5)  # 6 k (k + 1) vertices
    corner = np.pi / 3 * np.arange(6)
    hexagon = np.concatenate([[[0.0, 0, 0]], np.stack([np.cos(corner), np.sin(corner), 0 * corner], axis=1)])
    fan = np.array([[0, 1 + k, 1 + (k + 1) % 6] for k in range(6)])
    points, triangles = subdivided(hexagon, fan, rings)
    x, y = points[:, :2].T
    turn = np.floor(np.arctan2(y, x) / (np.pi / 3) + 1e-9)
    c, s = np.cos(turn * np.pi / 3), np.sin(turn * np.pi / 3)
    u, v = c * x + s * y, c * y - s * x  # in the first of the six
    along = v / np.sqrt(0.75)
    ring = u + 0.5 * along
    share = np.divide(along, ring, out=np.zeros_like(ring), where=ring > 1e-9)
    angle = (turn + share) * np.pi / 3
    mesh = dual((np.stack([ring * np.cos(angle), ring * np.sin(angle), 0 * ring], axis=1), triangles))
    drawn = mesh.vertices.copy()
    rim = on_border(mesh)
    drawn[rim] /= np.linalg.norm(drawn[rim], axis=1, keepdims=True)
    return Patch("plane", f, mesh.moved(drawn), drawn[:, :2].copy())


def on_border(mesh: SimplexMesh) -> NDArray[np.bool_]:
    """Return (n,) which vertices are on a hole."""
    return np.asarray(mesh.connectivity.face_is_hole[mesh.connectivity.face].any(axis=1))
