"""Models of parts with known creases, sharp and smooth: normals near the creases, where the lines are, how many.

Usage: python tests/benchmarks/bench_creases.py [vertices] [seed] [what]

With 1 as third argument computed tomographies of the parts are taken instead of points: 200 voxels long, with partial
volume, a Gaussian blur of 0.8 voxels and noise of 5 % of the contrast. With 2 points on smooth bodies: how many
creases they get, which all are false.
"""

from __future__ import annotations

import sys
import time
import warnings
from pathlib import Path

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

sys.path.insert(0, str(Path(__file__).parents[2]))

import simplexmesh as sm
from tests.benchmarks.smooth_bodies import bodies
from tests.surface.features.parts import SHAPES, reference
from tests.surface.features.remeshing import dots, face_normals
from tests.surface.features.scoring import paths, samples, share_near

POINTS, NOISE = 30_000, (0.0, 0.002)  # noise in diagonals
WITHIN = 0.003  # diagonals: found and true lines agree
COLUMNS = ("normals before", "after", "elsewhere", "mean before", "after", "precision", "recall", "line rms", "seconds")


def sampled(part, noise, rng):
    vertices, faces, _ = part.fine
    vectors = np.linalg.norm(np.cross(*(vertices[faces[:, k]] - vertices[faces[:, 0]] for k in (1, 2))), axis=1)
    rows = rng.choice(len(faces), POINTS, p=vectors / vectors.sum())
    points = np.einsum("ni,nij->nj", rng.dirichlet([1, 1, 1], POINTS), vertices[faces[rows]])
    points = part.nearest(points)[1]
    return points + noise * np.linalg.norm(np.ptp(points, axis=0)) * rng.normal(size=points.shape)


def scanned(part, rng, size=200, margin=10, blur=0.8, noise=0.05):
    """A volume of a part, 1 inside: voxels at the surface are means of 64 samples, then blurred, with noise."""
    low, high = part.fine[0].min(axis=0), part.fine[0].max(axis=0)
    voxel = (high - low).max() / (size - 2 * margin)
    shape = np.ceil((high - low) / voxel).astype(int) + 2 * margin
    origin = (low + high) / 2 - voxel * ((shape - 1) / 2 + rng.uniform(-0.5, 0.5, 3))
    fine = voxel * (np.indices((4, 4, 4)).reshape(3, -1).T - 1.5) / 4
    values = np.zeros(shape, np.float32)
    for i, layer in enumerate(values):
        at = origin + voxel * np.column_stack([np.full(layer.size, i), np.indices(layer.shape).reshape(2, -1).T])
        away = part.signed(at)
        inside, near = (away < 0).astype(np.float32), np.flatnonzero(np.abs(away) < 0.9 * voxel)
        if len(near):
            inside[near] = (part.signed((at[near, None] + fine).reshape(-1, 3)) < 0).reshape(-1, len(fine)).mean(axis=1)
        layer[:] = inside.reshape(layer.shape)
    values = ndimage.gaussian_filter(values, blur)
    return sm.Volume(values + noise * rng.normal(size=shape).astype(np.float32), spacing=voxel, origin=origin)


def exact_normals(part, points):
    """The nearest points of the exact surface, and its normals there."""
    vertices, faces, labels = part.fine
    rows, near = part.nearest(points)
    fine, out = face_normals(vertices, faces), np.zeros_like(points)
    for s in np.unique(labels[rows]):
        of = labels[rows] == s
        out[of] = part.distance(s, near[of])[1]
        out[of] *= np.sign(dots(out[of], fine[rows[of]]))[:, None]
    return near, out


def errors(part, mesh, creases):
    """Mean error of normals in degrees within two edges of true creases and elsewhere, mean distance in diagonals."""
    surface = mesh.triangulated("fan")
    centers, areas = surface.vertices[surface.faces].mean(axis=1), np.linalg.norm(surface.face_vectors, axis=1)
    near, normals = exact_normals(part, centers)
    turned = np.degrees(np.arccos(np.clip(dots(surface.face_vectors / areas[:, None], normals), -1, 1)))
    ends = mesh.vertices[mesh.connectivity.edge_vertices]
    edge = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).mean()
    beside = cKDTree(samples(creases, 0.1 * edge)[0]).query(centers)[0] < 2 * edge
    off = np.linalg.norm(centers - near, axis=1) / np.linalg.norm(np.ptp(part.fine[0], axis=0))
    means = [np.average(turned[rows], weights=areas[rows]) for rows in (beside, ~beside)]
    return *means, 100 * np.average(off, weights=areas)


def row(part, data, vertices, **options):
    creases = np.concatenate(part.creases)
    smooth = sm.reconstruct(data, vertices=vertices, creases="none", **options)
    began = time.process_time()
    sharp = sm.reconstruct(data, vertices=vertices, **options)
    seconds = time.process_time() - began
    before, after = errors(part, smooth.mesh, creases), errors(part, sharp.mesh, creases)
    diagonal = np.linalg.norm(np.ptp(part.fine[0], axis=0))
    found = np.concatenate([np.zeros((0, 2, 3)), *(np.stack([p[:-1], p[1:]], axis=1) for p in lines_of(sharp))])
    away = cKDTree(samples(creases, 1e-4 * diagonal)[0]).query(samples(found, 1e-3 * diagonal)[0])[0] / diagonal
    rms = 100 * np.sqrt((away[away < WITHIN] ** 2).mean()) if (away < WITHIN).any() else np.nan
    shares = share_near(found, creases, WITHIN * diagonal), share_near(part.creases[0], found, WITHIN * diagonal)
    return [before[0], after[0], after[1], before[2], after[2], *shares, rms, seconds]


def lines_of(model):
    """The creases of a model as `paths` takes the lines of a network."""
    return paths(type("Network", (), {"lines": model.creases}))


def smooth(vertices, seed):
    for name, body in bodies(seed):
        counts = []
        for noise in (0.0, 0.002, 0.005, 0.01):
            rng = np.random.default_rng(seed)
            points = body.sampled(POINTS, rng=rng).points
            points = points + noise * body.diagonal * rng.normal(size=points.shape)
            counts.append(len(sm.reconstruct(points, vertices=vertices).creases))
        print(f"{name:10} creases with noise of 0, 0.2, 0.5 and 1 %: {counts}", flush=True)


def main(vertices=6000, seed=0, volumes=0):
    warnings.simplefilter("ignore")
    if volumes == 2:
        smooth(vertices, seed)
        return
    print(f"{vertices:,} vertices; degrees, percent of the diagonal, shares, CPU seconds")
    print(f"{'':16}" + "".join(f"{name:>15}" for name in COLUMNS))
    for noise in (0.05,) if volumes else NOISE:
        rows = []
        for name in SHAPES:
            part, rng = reference(name, seed), np.random.default_rng(seed)
            if volumes:
                rows.append(row(part, scanned(part, rng, noise=noise), vertices, level=0.5))
            else:
                rows.append(row(part, sampled(part, noise, rng), vertices))
            print(f"{name:10}{100 * noise:4.1f} %" + "".join(f"{value:15.3f}" for value in rows[-1]), flush=True)
        print(f"{'mean':10}{100 * noise:4.1f} %" + "".join(f"{value:15.3f}" for value in np.nanmean(rows, axis=0)))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
