"""Tables of rotations of the quasi-regular sphere: the vertex nearest to the image of each vertex.

A table is stored as few *representatives* times the 60 rotations of the icosahedron: rotation ``60 * j + g`` is
``group[g] @ representatives[j]`` and takes vertex l to vertex ``turns[g, maps[j, l]]``. They are even and about 12n: at
frequency 9 the nearest is 8 degrees away at most, 4 in the mean; of the thesis's 3n, from one vertex and its neighbors
to another and its neighbors, up to 30.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh.mesh.lattices import polyhedron
from simplexmesh.recognition.sai.sphere_domain import checked_frequency, sphere_domain

Table = NDArray[np.int16]

GROUP_ORDER = 60


@dataclass(frozen=True, eq=False)
class Rotations:
    """Rotations of the sphere of one frequency; made by `rotations`."""

    representatives: Array  # (m, 3, 3)
    maps: Table  # (m, n) the vertex nearest to the image of each vertex under each representative
    group: Array  # (60, 3, 3) the rotations of the icosahedron, the identity first
    turns: Table  # (60, n) the image of each vertex under each of these

    def __len__(self) -> int:
        return GROUP_ORDER * len(self.representatives)

    @cached_property
    def matrices(self) -> Array:
        """(60 m, 3, 3) rotation matrices."""
        return np.einsum("gab,jbc->jgac", self.group, self.representatives).reshape(-1, 3, 3)


def icosahedral_group() -> Array:
    """Return the 60 rotations (60, 3, 3) of the icosahedron that spheres are built on, the identity first."""
    corners, faces = polyhedron("icosahedron")
    images = np.concatenate([np.roll(faces, -shift, axis=1) for shift in range(3)])
    first = corners[faces[0]].T
    group = np.stack([corners[image].T @ np.linalg.inv(first) for image in images])
    order = np.argsort(-np.trace(group, axis1=1, axis2=2), kind="stable")
    u, _, v = np.linalg.svd(group[order])  # the nearest orthogonal matrix
    return np.asarray(u @ v)


def even_representatives(count: int, group: Array) -> Array:
    """Return about `count` rotations (m, 3, 3), evenly distributed in the Voronoi cell of the identity of a group."""
    # a body-centered cubic lattice of rotation vectors, the thinnest covering of space by balls
    spacing = (2 * 8 * np.pi**2 / (len(group) * count)) ** (1 / 3)
    reach = np.radians(46.0)
    k = np.arange(-np.ceil(reach / spacing), np.ceil(reach / spacing) + 1)
    grid = np.stack(np.meshgrid(k, k, k, indexing="ij"), axis=-1).reshape(-1, 3)
    off = np.array([0.137, 0.211, 0.318])  # so that no point lies on the boundary of the cell
    vectors = spacing * (np.vstack([grid, grid + 0.5]) + off)
    vectors = vectors[np.linalg.norm(vectors, axis=1) < reach]
    matrices = Rotation.from_rotvec(vectors).as_matrix()
    nearness = np.einsum("gab,jab->jg", group, matrices)
    return matrices[nearness.argmax(axis=1) == 0]


def _nearest(frequency: int, matrices: Array) -> Table:
    """Return the vertex nearest to the image of each vertex under each rotation, (k, n)."""
    vertices = sphere_domain(frequency).vertices
    images = np.einsum("kab,nb->kna", matrices, vertices)
    return cKDTree(vertices).query(images.reshape(-1, 3), workers=-1)[1].reshape(images.shape[:2]).astype(np.int16)


@lru_cache(maxsize=8)
def rotations(frequency: int) -> Rotations:
    """Return the rotations of a frequency; cached."""
    group = icosahedral_group()
    count = 12 * sphere_domain(checked_frequency(frequency)).mesh.n_vertices // GROUP_ORDER
    representatives = even_representatives(count, group)
    parts = representatives, _nearest(frequency, representatives), group, _nearest(frequency, group)
    return Rotations(*(checks.frozen(part) for part in parts))
