"""Rotations of the sphere as tables of indices: which vertex comes to lie nearest to which.

The quasi-regular sphere has the 60 rotations of the icosahedron and no others. A table of many rotations is therefore
kept as few *representatives* times the 60: rotation ``60 * j + g`` is ``group[g] @ representatives[j]`` and takes
vertex l to vertex ``turns[g, maps[j, l]]``.

Two families of representatives are built. ``darts`` are the thesis's: those that take one vertex and its neighbors to
another vertex and its neighbors, 3n in all. They take the first vertex near to any place, but there few turns about
it are left, 60 degrees apart: a rotation may be 30 degrees from the nearest of the 4,860 of frequency 9, and is 14 in
the mean. ``even`` are a body-centered lattice in the space of rotations, four times as many: 8 degrees at most and 4
in the mean. Both come to the nearest vertex; to walk darts instead, as on a regular mesh, goes wrong at pentagons.
"""

from __future__ import annotations

import os
import zipfile
import zlib
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _cache, _check
from simplexmesh._vec import normalized
from simplexmesh.mesh.lattices import polyhedron
from simplexmesh.recognition.sphere_domain import checked_frequency, sphere_domain

Array = NDArray[np.float64]
Table = NDArray[np.int16]

FAMILIES = ("even", "darts")
TURNS = 60
SPACINGS = 4
"""The even family has about so many representatives for each of the darts'."""

VERSION = 1


@dataclass(frozen=True, eq=False)
class Rotations:
    """A family of rotations of the sphere of one frequency; made by `rotations`.

    Attributes
    ----------
    frequency : int
    family : {"even", "darts"}
    representatives : (m, 3, 3) array of float
    maps : (m, n) array of int16
        ``maps[j, l]`` is the vertex nearest to where representative j takes vertex l.
    group : (60, 3, 3) array of float
        The rotations of the icosahedron, the first of them the identity.
    turns : (60, n) array of int16
        ``turns[g, i]`` is where the icosahedron's rotation g takes vertex i.
    """

    frequency: int
    family: str
    representatives: Array
    maps: Table
    group: Array
    turns: Table

    def __len__(self) -> int:
        return TURNS * len(self.representatives)

    @cached_property
    def matrices(self) -> Array:
        """(60 m, 3, 3) the rotations themselves, all proper."""
        return np.einsum("gab,jbc->jgac", self.group, self.representatives).reshape(-1, 3, 3)

    def indices(self) -> Table:
        """Return the whole table, (60 m, n): where each rotation takes each vertex, to the nearest.

        Examples
        --------
        >>> table = rotations(5, "darts").indices()
        >>> table.shape, table.dtype
        ((1500, 500), dtype('int16'))
        """
        return np.moveaxis(self.turns[:, self.maps], 0, 1).reshape(len(self), -1)


def icosahedral_group() -> Array:
    """Return the 60 rotations of the icosahedron that spheres are made of, (60, 3, 3), the identity first.

    Examples
    --------
    >>> group = icosahedral_group()
    >>> bool(np.allclose(group[0], np.eye(3))), bool(np.allclose(np.linalg.det(group), 1))
    (True, True)
    """
    corners, faces = polyhedron("icosahedron")
    images = np.concatenate([np.roll(faces, -shift, axis=1) for shift in range(3)])
    first = corners[faces[0]].T
    group = np.stack([corners[image].T @ np.linalg.inv(first) for image in images])
    order = np.argsort(-np.trace(group, axis1=1, axis2=2), kind="stable")
    u, _, v = np.linalg.svd(group[order])  # free of rounding
    return np.asarray(u @ v)


def dart_representatives(frequency: int, turns: Table) -> Array:
    """Return one rotation (m, 3, 3) for each orbit of the darts under the icosahedron: it takes dart 0 to the dart."""
    mesh = sphere_domain(frequency).mesh
    darts = mesh.connectivity.n_vertices * 3
    vertex, other = np.arange(darts) // 3, mesh.neighbors.ravel().astype(np.int64)
    code = np.full(darts, np.iinfo(np.int64).max)
    for turn in turns.astype(np.int64):
        code = np.minimum(code, turn[vertex] * mesh.n_vertices + turn[other])
    chosen = np.unique(code, return_index=True)[1]
    frames = _frames(mesh.vertices[vertex[chosen]], mesh.vertices[other[chosen]])
    reference = _frames(mesh.vertices[vertex[:1]], mesh.vertices[other[:1]])[0]
    return np.asarray(frames @ reference.T)


def _frames(at: Array, toward: Array) -> Array:
    """Return orthonormal frames (k, 3, 3) as columns: a unit vector, the tangent toward another, and their product."""
    tangent = normalized(toward - np.einsum("ij,ij->i", at, toward)[:, None] * at)
    return np.stack([at, tangent, np.cross(at, tangent)], axis=2)


def even_representatives(count: int, group: Array) -> Array:
    """Return about so many rotations (m, 3, 3), evenly spread among those nearest to the identity of a group.

    A body-centered cubic lattice of rotation vectors, the thinnest covering of space by balls; space is so little
    bent within the 44 degrees this reaches that distances hold within 3 %.
    """
    spacing = (2 * 8 * np.pi**2 / (len(group) * count)) ** (1 / 3)
    reach = np.radians(46.0)
    k = np.arange(-np.ceil(reach / spacing), np.ceil(reach / spacing) + 1)
    grid = np.stack(np.meshgrid(k, k, k, indexing="ij"), axis=-1).reshape(-1, 3)
    off = np.array([0.137, 0.211, 0.318])  # so that none lies on a border between two of the group
    vectors = spacing * (np.vstack([grid, grid + 0.5]) + off)
    vectors = vectors[np.linalg.norm(vectors, axis=1) < reach]
    matrices = rotations_of(vectors)
    nearness = np.einsum("gab,jab->jg", group, matrices)
    return matrices[nearness.argmax(axis=1) == 0]


def rotations_of(vectors: Array) -> Array:
    """Return the rotations (k, 3, 3) about axes (k, 3) by their lengths in radians.

    Examples
    --------
    >>> rotations_of(np.array([[0, 0, np.pi / 2]])).round(6)[0] @ [1, 0, 0]
    array([0., 1., 0.])
    """
    angle = np.linalg.norm(vectors, axis=1)
    x, y, z = (vectors / np.where(angle > 0, angle, 1)[:, None]).T
    zero = np.zeros_like(x)
    K = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.asarray(np.eye(3) + s * K + (1 - c) * (K @ K))


def angles_between(first: Array, second: Array) -> Array:
    """Return the angles in radians of the rotations between rotations (k, 3, 3) and others (m, 3, 3), as (k, m).

    Examples
    --------
    >>> angles_between(np.eye(3)[None], rotations_of(np.array([[0, 0.25, 0]]))).round(6)
    array([[0.25]])
    """
    cosine = (np.einsum("kab,mab->km", first, second) - 1) / 2
    return np.asarray(np.arccos(np.clip(cosine, -1, 1)))


def built(frequency: int, family: str) -> Rotations:
    """Return a family of rotations, computed."""
    here = sphere_domain(frequency)
    group = icosahedral_group()
    turns = _nearest(frequency, group)
    if family == "darts":
        representatives = dart_representatives(frequency, turns)
    else:
        representatives = even_representatives(SPACINGS * 3 * here.mesh.n_vertices // TURNS, group)
    return Rotations(frequency, family, representatives, _nearest(frequency, representatives), group, turns)


def _nearest(frequency: int, matrices: Array) -> Table:
    """Return, for each rotation and vertex, the vertex nearest to where it comes, (k, n)."""
    from scipy.spatial import cKDTree

    vertices = sphere_domain(frequency).vertices
    images = np.einsum("kab,nb->kna", matrices, vertices)
    return cKDTree(vertices).query(images.reshape(-1, 3), workers=-1)[1].reshape(images.shape[:2]).astype(np.int16)


@lru_cache(maxsize=8)
def rotations(frequency: int, family: str = "even") -> Rotations:
    """Return a family of rotations: from memory, from the user's cache folder, or computed and left there.

    Parameters
    ----------
    frequency : int
        5 to 12.
    family : {"even", "darts"}

    Returns
    -------
    Rotations

    Examples
    --------
    >>> len(rotations(9, "darts"))
    4860
    """
    checked_frequency(frequency)
    _check.choice("family", family, FAMILIES)
    folder = _cache.table_folder()
    path = None if folder is None else folder / f"rotations-{VERSION}-{family}-{frequency}.npz"
    found = None if path is None else _read(path, frequency, family)
    if found is None:
        found = built(frequency, family)
        if path is not None:
            _leave(path, found)
    for name in ("representatives", "maps", "group", "turns"):
        getattr(found, name).setflags(write=False)
    return found


def _read(path: Path, frequency: int, family: str) -> Rotations | None:
    """Return the tables in a file, or None where they are not whole."""
    n = 20 * frequency**2
    try:
        with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
            parts: dict[str, NDArray[Any]] = {
                name: file[name] for name in ("representatives", "maps", "group", "turns")
            }
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error):
        return None
    m = len(parts["representatives"])
    shapes = {"representatives": (m, 3, 3), "maps": (m, n), "group": (TURNS, 3, 3), "turns": (TURNS, n)}
    valid = all(parts[name].shape == shape for name, shape in shapes.items())
    for name in ("maps", "turns"):
        valid = valid and parts[name].dtype == np.int16 and parts[name].min() >= 0 and parts[name].max() < n
    return Rotations(frequency, family, **parts) if valid and m > 0 else None


def _leave(path: Path, found: Rotations) -> None:
    """Write tables for other processes, whole or not at all; a folder that is full or closed is nobody's problem."""
    draft = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with draft.open("wb") as file:
            np.savez(
                file,
                representatives=found.representatives,
                maps=found.maps,
                group=found.group,
                turns=found.turns,
            )
        os.replace(draft, path)
    except OSError:
        pass
    finally:  # also when interrupted
        with suppress(OSError):
            draft.unlink(missing_ok=True)
