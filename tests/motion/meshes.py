"""Meshes and targets that the tests of the motion share."""

from __future__ import annotations

import numpy as np

import simplexmesh as sm
from simplexmesh._base.vectors import norm


def noisy_sphere(seed=0, *, frequency=7, radius=32.0, noise=0.3):
    ball = sm.sphere(frequency, radius=radius)
    radial = noise * np.random.default_rng(seed).normal(size=(ball.n_vertices, 1))
    return ball.moved(ball.vertices * (1 + radial / radius))


def roundness(mesh):
    """Return 36 pi V^2 / A^3: 1 for a ball, less for everything else."""
    return 36 * np.pi * mesh.volume**2 / mesh.area**3


def irregular_sphere(seed=0, *, radius=1.0, frequency=8):
    """Return a sphere with unevenly spaced vertices."""
    ball = sm.sphere(frequency)
    rng = np.random.default_rng(seed)
    spread = ball.vertices + 0.07 / frequency * rng.normal(size=ball.vertices.shape) + [0, 0, 0.4]
    return ball.moved(radius * spread / norm(spread)[:, None])


def evolved(mesh, iterations, target=None, **options):
    model = sm.DeformableModel(mesh, target, **options)
    for _ in model.run(iterations, every=iterations, warnings=False):
        pass
    return model.mesh


def open_square(size=9, bump=0.0):
    """Return a flat square with one hole: its border."""
    x, y = np.meshgrid(np.arange(size, dtype=float), np.arange(size, dtype=float), indexing="ij")
    number = np.arange(size * size).reshape(size, size)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    z = bump * np.exp(-((x - size / 2) ** 2 + (y - size / 2) ** 2) / 4)
    return sm.dual((np.stack([x, y, z], -1).reshape(-1, 3), faces))


def open_tube(around=24, along=12, radius=1.0, length=2.0):
    """Return a cylinder with two holes: its ends, whose rims are circles of evenly spaced vertices."""
    angle, height = np.meshgrid(2 * np.pi * np.arange(around) / around, np.linspace(0, length, along), indexing="ij")
    number = np.arange(around * along).reshape(around, along)
    a, b = number[:, :-1], np.roll(number, -1, axis=0)[:, :-1]
    c, d = np.roll(number, -1, axis=0)[:, 1:], number[:, 1:]
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), height], -1).reshape(-1, 3)
    mesh = sm.dual((points, faces))
    return mesh.moved(np.c_[radius * mesh.vertices[:, :2] / norm(mesh.vertices[:, :2])[:, None], mesh.vertices[:, 2]])


class Everywhere:
    """A target at the same gap from every vertex."""

    def __init__(self, gap):
        self.value = gap

    def gap(self, vertices, normals, reach):
        return np.full(len(vertices), self.value)


def rotation(seed):
    Q, R = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    Q *= np.sign(np.diag(R))
    Q[:, 0] *= np.linalg.det(Q)
    return Q


def procrustes(mesh, kept):
    """Return the root mean square distance to `kept` after the best similarity, over its size."""
    a, b = mesh.vertices - mesh.vertices.mean(axis=0), kept.vertices - kept.vertices.mean(axis=0)
    U, S, Vt = np.linalg.svd(a.T @ b)
    return np.sqrt(1 - min((S * [1, 1, np.linalg.det(U @ Vt)]).sum() ** 2 / ((a**2).sum() * (b**2).sum()), 1.0))


def hole_places(mesh):
    """Return the positions in `face_vertices` that belong to holes."""
    topology = mesh.connectivity
    return np.repeat(topology.face_is_hole, np.diff(topology.face_offsets))


def rim_of(mesh):
    return np.unique(mesh.connectivity.face_vertices[hole_places(mesh)])
