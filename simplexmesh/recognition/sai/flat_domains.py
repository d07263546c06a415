"""The flat domains of signatures of other topologies: a torus, a cylinder and a disc of hexagons."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh.mesh.duality import dual
from simplexmesh.mesh.lattices import strip, subdivided, tube
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.recognition.sai.sphere_domain import SphereDomain, checked_frequency, sphere_domain

TOPOLOGIES = ("sphere", "torus", "cylinder", "plane")
PERIODIC = {"torus": (True, True), "cylinder": (True, False), "plane": (False, False)}


@dataclass(frozen=True, eq=False)
class FlatDomain:
    """The regular mesh of a topology and frequency, with coordinates in the plane; made by `domain`."""

    topology: str
    frequency: int
    mesh: SimplexMesh  # as drawn, about the z axis
    coordinates: Array  # (n, 2) turns around the axis and around the tube, or along it from 0 to 1; in the unit disc

    @property
    def vertices(self) -> Array:
        """(n, 3) vertices as drawn."""
        return self.mesh.vertices

    @cached_property
    def cell_areas(self) -> Array:
        """(n,) area of each vertex's dual cell; sum 4 pi, as on the sphere."""
        n = len(self.coordinates)
        fraction = np.ones(n)
        fraction[border_mask(self.mesh)] = 0.5
        return 4 * np.pi * fraction / fraction.sum()

    @property
    def period(self) -> Array:
        """(2,) width and height of the domain with regular hexagons; 1 for the disc."""
        f = self.frequency
        rows = {"torus": 2 * f, "cylinder": 2 * f - 1}
        return np.array([1.0, 1.0 if self.topology == "plane" else rows[self.topology] * np.sqrt(0.75) / (5 * f)])

    def locate(self, coordinates: Array) -> tuple[Indices, Array]:
        """Return vertices (k, 3) and barycentric coordinates (k, 3) of the triangles that hold points (k, 2)."""
        triangles, rows = self._triangles
        at = np.array(coordinates, dtype=float)
        for axis, periodic in enumerate(PERIODIC[self.topology]):
            at[:, axis] = at[:, axis] % 1.0 if periodic else np.clip(at[:, axis], -1.0, 1.0)
        at *= self.period
        found = triangles.find_simplex(at)
        outside = found < 0  # between a border's chord and its arc
        if outside.any():
            found[outside] = triangles.find_simplex(0.97 * at[outside] + 0.03 * self._center)
        affine = triangles.transform[found]
        first = np.einsum("kab,kb->ka", affine[:, :2], at - affine[:, 2])
        weights = np.clip(np.column_stack([first, 1 - first.sum(axis=1)]), 0.0, None)
        return rows[triangles.simplices[found]], weights / weights.sum(axis=1, keepdims=True)

    @property
    def _center(self) -> Array:
        return np.zeros(2) if self.topology == "plane" else 0.5 * self.period

    @cached_property
    def _triangles(self) -> tuple[Any, Indices]:
        """The Delaunay triangulation of the vertices and their periodic copies, and the vertex of each point."""
        from scipy.spatial import Delaunay

        flat, rows = self.coordinates * self.period, np.arange(len(self.coordinates))
        for axis, periodic in enumerate(PERIODIC[self.topology]):
            if periodic:
                step = np.eye(2)[axis] * self.period
                flat, rows = np.concatenate([flat - step, flat, flat + step]), np.tile(rows, 3)
        kept = (np.abs(flat - self._center) < 0.62 * self.period).all(axis=1) if self.topology != "plane" else rows >= 0
        return Delaunay(flat[kept]), rows[kept]


def domain(topology: str, frequency: int) -> SphereDomain | FlatDomain:
    """Return the domain of signatures of a topology and frequency: 20 f^2 vertices, on a disc about as many."""
    f = checked_frequency(frequency)
    checks.choice("topology", topology, TOPOLOGIES)
    return sphere_domain(f) if topology == "sphere" else flat_domain(topology, f)


@lru_cache(maxsize=16)
def flat_domain(topology: str, frequency: int) -> FlatDomain:
    """Return the torus, cylinder or disc ("plane") of a frequency; cached."""
    return {"torus": _torus, "cylinder": _cylinder, "plane": _disc}[topology](frequency)


def _torus(f: int) -> FlatDomain:
    uv, triangles = tube(5 * f, 2 * f)
    first = uv[triangles[:, 0]]
    off = uv[triangles] - first[:, None]
    at = (first + (off - np.rint(off)).mean(axis=1)) % 1.0
    mesh = dual((_torus_points(uv), triangles))
    return FlatDomain("torus", f, mesh.moved(_torus_points(at)), at)


def _torus_points(at: Array) -> Array:
    around, across = 2 * np.pi * at.T
    reach = 1 + 0.35 * np.cos(across)
    return np.stack([reach * np.cos(around), reach * np.sin(around), 0.35 * np.sin(across)], axis=1)


def _cylinder(f: int) -> FlatDomain:
    uv, triangles = strip(5 * f, 2 * f - 1)
    angle = 2 * np.pi * uv[:, 0]
    mesh = dual((np.stack([np.cos(angle), np.sin(angle), uv[:, 1]], axis=1), triangles))
    x, y, height = mesh.vertices.T
    at = np.stack([np.arctan2(y, x) / (2 * np.pi) % 1.0, height], axis=1)
    angle, tall = 2 * np.pi * at[:, 0], 2 * np.pi * np.sqrt(0.75) * (2 * f - 1) / (5 * f)
    drawn = np.stack([np.cos(angle), np.sin(angle), tall * (height - 0.5)], axis=1)
    return FlatDomain("cylinder", f, mesh.moved(drawn), at)


def _disc(f: int) -> FlatDomain:
    """Return the dual of a triangulated hexagon whose rings are mapped to circles."""
    rings = round(np.sqrt(10 / 3) * f - 0.5)  # 6 k (k + 1) vertices
    corner = np.pi / 3 * np.arange(6)
    hexagon = np.concatenate([[[0.0, 0, 0]], np.stack([np.cos(corner), np.sin(corner), 0 * corner], axis=1)])
    fan = np.array([[0, 1 + k, 1 + (k + 1) % 6] for k in range(6)])
    points, triangles = subdivided(hexagon, fan, rings)
    x, y = points[:, :2].T
    turn = np.floor(np.arctan2(y, x) / (np.pi / 3) + 1e-9)
    c, s = np.cos(turn * np.pi / 3), np.sin(turn * np.pi / 3)
    u, v = c * x + s * y, c * y - s * x  # rotated into the first of the six sectors
    along = v / np.sqrt(0.75)
    ring = u + 0.5 * along
    fraction = np.divide(along, ring, out=np.zeros_like(ring), where=ring > 1e-9)
    angle = (turn + fraction) * np.pi / 3
    mesh = dual((np.stack([ring * np.cos(angle), ring * np.sin(angle), 0 * ring], axis=1), triangles))
    drawn = mesh.vertices.copy()
    rim = border_mask(mesh)
    drawn[rim] /= np.linalg.norm(drawn[rim], axis=1, keepdims=True)
    return FlatDomain("plane", f, mesh.moved(drawn), drawn[:, :2].copy())


def border_mask(mesh: SimplexMesh) -> Mask:
    """Return a mask (n,) of the vertices on a border."""
    return np.asarray(mesh.connectivity.face_is_hole[mesh.connectivity.face].any(axis=1))
