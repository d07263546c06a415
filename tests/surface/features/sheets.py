"""Sheets of triangles over rectangles, folded along the x-axis, and meshes with noise."""

from __future__ import annotations

import numpy as np

import simplexmesh as sm


def sheet(height, length=2.0, *, step=0.05, seed=0):
    """The graph of a function over [0, length] x [-0.75, 0.75]; vertices are regular on the border and where y is 0."""
    n, m = round(length / step) + 1, 31
    x, y = np.meshgrid(np.linspace(0, length, n), np.linspace(-0.75, 0.75, m), indexing="ij")
    free = np.ones((n, m), bool)
    free[[0, -1]] = free[:, [0, m // 2, -1]] = False
    dx, dy = 0.2 * step * free * np.random.default_rng(seed).uniform(-1, 1, (2, n, m))
    x, y = x + dx, y + dy
    at = np.arange(n * m).reshape(n, m)
    a, b, c, d = at[:-1, :-1].ravel(), at[1:, :-1].ravel(), at[1:, 1:].ravel(), at[:-1, 1:].ravel()
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return sm.TriangleMesh(np.stack([x.ravel(), y.ravel(), height(x, y).ravel()], axis=1), faces)


def folded(degrees, length=2.0):
    """A sheet folded by so many degrees, a number or a function of x."""
    angle = degrees if callable(degrees) else lambda x: degrees + 0 * x
    return sheet(lambda x, y: -np.abs(y) * np.tan(np.radians(angle(x)) / 2), length)


def mean_edge(mesh):
    corners = mesh.vertices[mesh.faces]
    return float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())


def shaken(mesh, share, seed=0):
    """A mesh with every vertex moved by normally distributed noise, its deviation in mean edges."""
    moves = share * mean_edge(mesh) * np.random.default_rng(seed).normal(size=mesh.vertices.shape)
    return sm.TriangleMesh(mesh.vertices + moves, mesh.faces)
