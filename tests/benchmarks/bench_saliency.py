"""Saliency: nanoseconds per vertex, and a ratio against windows of straight distance from a tree, as in the paper."""

from __future__ import annotations

import time

import numpy as np
from scipy.spatial import cKDTree

import simplexmesh as sm
from simplexmesh.surface.saliency.diffusion import Diffusion
from simplexmesh.surface.saliency.noise import smallest_window
from simplexmesh.surface.sampled_surface import as_sampled_surface


def timed(function, repeats=3):
    """The least time of several runs, in seconds."""
    best = np.inf
    for _ in range(repeats):
        began = time.perf_counter()
        function()
        best = min(best, time.perf_counter() - began)
    return best


def straight(mesh, field, scales):
    """Means over all vertices within two widths, weighted by exp(-d^2 / 2 s^2): a tenth of the vertices."""
    tree, some = cKDTree(mesh.vertices), np.arange(0, mesh.n_vertices, 10)
    for scale in scales:
        for i, near in zip(some, tree.query_ball_point(mesh.vertices[some], 2 * scale, workers=-1), strict=True):
            weights = np.exp(-((mesh.vertices[near] - mesh.vertices[i]) ** 2).sum(axis=1) / (2 * scale**2))
            weights @ field[near] / weights.sum()


def main():
    for around, across in ((200, 100), (400, 250)):
        mesh = sm.torus(around, across).triangulated("dual")
        curvature = sm.curvature(mesh, "sine")
        diffusion = Diffusion(as_sampled_surface(mesh))
        smallest = smallest_window(diffusion)
        scales = [smallest * k for k in (1, 1.5, 2, 2.5, 3, 4, 5, 6)]
        n = mesh.n_vertices
        ours = timed(lambda mesh=mesh, curvature=curvature: sm.saliency(mesh, curvature=curvature))
        peer = 10 * timed(lambda mesh=mesh, field=curvature.mean, scales=scales: straight(mesh, field, scales), 1)
        points = timed(lambda mesh=mesh, curvature=curvature: sm.salient_points(mesh, curvature=curvature))
        kinds = timed(lambda mesh=mesh, curvature=curvature: sm.hk_classes(mesh, curvature=curvature))
        per = 1e9 / n
        print(f"{n:,} vertices, smallest window {smallest / diffusion.spacing:.1f} edges")
        print(f"  saliency {ours * per:7.0f} ns   windows from a tree {peer * per:9.0f} ns   ratio {peer / ours:.0f}")
        print(f"  salient points {points * per:7.0f} ns   HK classes {kinds * per:7.0f} ns")


if __name__ == "__main__":
    main()
