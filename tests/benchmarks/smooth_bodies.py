"""Smooth closed bodies to sample points from: scans of the data folder, and shapes drawn at random from implicit forms.

Each drawn body is the zero set of a function, triangulated finely, its vertices then moved onto it by Newton steps.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import igl
import numpy as np
import pyvista as pv
from scipy.spatial import cKDTree
from skimage.measure import marching_cubes

import simplexmesh as sm

Field = Callable[[np.ndarray], np.ndarray]

SCANS = ("spot.obj", "elephant.off", "lion_head.off", "femur.off", "knot1.off", "eight.off")
CELLS = 180  # of the grid, along the longest axis


def rods(places: np.ndarray, ends: np.ndarray, radii: np.ndarray, blend: float) -> np.ndarray:
    """Return the height above tapered rods (m, 2, 3) with radii (m, 2) at their ends, blended over a length."""
    total = np.zeros(len(places))
    for (a, b), (r, s) in zip(ends, radii, strict=True):
        along = np.clip((places - a) @ (b - a) / max((b - a) @ (b - a), 1e-12), 0, 1)
        away = np.linalg.norm(places - a - along[:, None] * (b - a), axis=1) - (r + along * (s - r))
        total += np.exp(np.clip(-away / blend, -200, 200))
    return -blend * np.log(np.maximum(total, 1e-80))


def animal(rng: np.random.Generator) -> Field:
    """A body on four thin legs, with a head, ears, horns and a tail."""
    length, slim = rng.uniform(0.7, 1.1), rng.uniform(0.035, 0.055)
    ends = [[[-length / 2, 0, 0], [length / 2, 0, 0.05]], [[length / 2, 0, 0.1], [length / 2 + 0.3, 0, 0.4]]]
    radii = [[0.22, 0.2], [0.12, 0.14]]
    for x in (-1, 1):
        for y in (-1, 1):
            foot = np.array([x * length / 2, y * 0.18, -0.75]) + rng.normal(0, 0.06, 3)
            ends.append([[x * length / 2, y * 0.12, -0.1], foot])
            radii.append([0.09, slim])
    for y in (-1, 1):
        ends.append([[length / 2 + 0.28, y * 0.08, 0.5], [length / 2 + 0.22, y * 0.25, 0.72]])
        radii.append([0.05, 0.022])
    ends.append([[-length / 2 - 0.1, 0, 0.1], [-length / 2 - 0.45, 0.1, rng.uniform(-0.3, 0.5)]])
    radii.append([0.05, 0.025])
    ends, radii = np.array(ends), np.array(radii)
    return lambda places: rods(places, ends, radii, 0.025)


def hand(rng: np.random.Generator) -> Field:
    """A palm with five tapered fingers, each of two rods."""
    ends, radii = [[[-0.25, 0, 0], [0.25, 0, 0]], [[-0.2, 0, 0.3], [0.25, 0, 0.3]]], [[0.16, 0.16], [0.17, 0.17]]
    for k, lean in enumerate(np.linspace(-0.9, 0.5, 5)):
        root = np.array([-0.32 + 0.16 * k, 0, 0.25 if k else 0.0])
        way = np.array([np.sin(lean), rng.normal(0, 0.15), np.cos(lean)])
        knuckle, size = root + rng.uniform(0.35, 0.5) * way, rng.uniform(0.055, 0.075)
        tip = knuckle + rng.uniform(0.25, 0.35) * (way + np.array([0, rng.uniform(0, 0.8), 0]))
        ends += [[root, knuckle], [knuckle, tip]]
        radii += [[0.085, size], [size, 0.6 * size]]
    ends, radii = np.array(ends), np.array(radii)
    return lambda places: rods(places, ends, radii, 0.02)


def blobs(rng: np.random.Generator) -> Field:
    """Metaballs in a chain, of sizes one to four."""
    centers = np.cumsum(rng.normal(0, 0.25, (9, 3)), axis=0)
    sizes = rng.uniform(0.1, 0.4, 9)

    def field(places: np.ndarray) -> np.ndarray:
        away = ((places[:, None] - centers) ** 2).sum(axis=2) / sizes**2
        return 0.5 - np.exp(-away).sum(axis=1)

    return field


def knot(rng: np.random.Generator) -> Field:
    """A tube of changing radius swept along a torus knot."""
    t = np.linspace(0, 2 * np.pi, 4000, endpoint=False)
    p, q = ((2, 3), (3, 2), (2, 5))[rng.integers(3)]
    ring, thin, waves = 1 + 0.4 * np.cos(q * t), rng.uniform(0.08, 0.11), int(rng.integers(3, 8))
    line = np.column_stack([ring * np.cos(p * t), ring * np.sin(p * t), 0.4 * np.sin(q * t)])
    tree = cKDTree(line)

    def field(places: np.ndarray) -> np.ndarray:
        _, nearest = tree.query(places, k=2, workers=-1)
        a, b = line[nearest[:, 0]], line[nearest[:, 1]]
        share = np.clip(((places - a) * (b - a)).sum(axis=1) / ((b - a) ** 2).sum(axis=1), 0, 1)[:, None]
        return np.linalg.norm(places - a - share * (b - a), axis=1) - thin * (
            1 + 0.25 * np.sin(waves * t[nearest[:, 0]])
        )

    return field


def relief(rng: np.random.Generator) -> Field:
    """A sphere with waves of three lengths, the shortest on one side."""
    waves = [(n, a, rng.normal(0, 1, (6, 3)), rng.uniform(0, 6, 6)) for n, a in ((2, 0.05), (5, 0.025), (11, 0.008))]

    def field(places: np.ndarray) -> np.ndarray:
        radius = np.linalg.norm(places, axis=1)
        unit = places / np.maximum(radius, 1e-9)[:, None]
        height = np.ones(len(places))
        for n, a, ways, phases in waves:
            side = 1 if n < 11 else 1 / (1 + np.exp(-8 * unit[:, 0]))
            height += side * a * np.sin(n * unit @ ways.T + phases).sum(axis=1)
        return radius - height

    return field


def casting(rng: np.random.Generator) -> Field:
    """A rounded block with a boss, less two bores and a pocket, all their edges filleted."""
    half, fillet = np.array([0.6, 0.4, 0.22]) * rng.uniform(0.85, 1.15, 3), 0.02
    bores = np.column_stack([rng.uniform(-0.4, -0.2, 2) * [1, -1], rng.uniform(-0.1, 0.1, 2)])
    sizes, deep = rng.uniform(0.07, 0.12, 2), rng.uniform(0.0, 0.1)

    def join(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return -fillet * np.logaddexp(-a / fillet, -b / fillet)

    def field(places: np.ndarray) -> np.ndarray:
        q = np.abs(places) - half + 0.06
        out = np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0) - 0.06
        boss = np.maximum(np.hypot(places[:, 0], places[:, 1]) - 0.16, np.abs(places[:, 2] - 0.2) - 0.2)
        out = join(out, boss)
        for center, size in zip(bores, sizes, strict=True):
            out = -join(-out, np.hypot(places[:, 0] - center[0], places[:, 1] - center[1]) - size)
        return -join(-out, np.linalg.norm(places - [0, 0, deep - 0.3], axis=1) - 0.2)

    return field


def rings(rng: np.random.Generator) -> Field:
    """Four rings melted together: genus 4 or more."""
    centers, turns = rng.uniform(-0.35, 0.35, (4, 3)), rng.normal(0, 1, (4, 3))
    turns /= np.linalg.norm(turns, axis=1)[:, None]

    def field(places: np.ndarray) -> np.ndarray:
        total = np.zeros(len(places))
        for center, axis in zip(centers, turns, strict=True):
            d = places - center
            up = d @ axis
            around = np.sqrt(np.maximum((d**2).sum(axis=1) - up**2, 0))
            total += np.exp(-((np.hypot(around - 0.5, up)) ** 2) / 0.09**2)
        return 0.4 - total

    return field


def triangulated(field: Field) -> sm.TriangleMesh:
    """Return the largest piece of the zero set of a field."""
    low, high = np.full(3, -2.5), np.full(3, 2.5)
    for cells in (48, CELLS):  # the first time to find the body
        step = (high - low).max() / cells
        axes = [np.arange(a - 3 * step, b + 3 * step, step) for a, b in zip(low, high, strict=True)]
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        values = np.concatenate([field(plane.reshape(-1, 3)) for plane in grid]).reshape(grid.shape[:3])
        vertices, faces, *_ = marching_cubes(values, 0.0, spacing=(step,) * 3, gradient_direction="descent")
        vertices = vertices + grid[0, 0, 0]
        low, high = vertices.min(axis=0) - step, vertices.max(axis=0) + step  # thin tips lie between the first samples
    for _ in range(4):
        value, tiny = field(vertices), 1e-5
        slope = np.stack([field(vertices + tiny * e) - field(vertices - tiny * e) for e in np.eye(3)], axis=1)
        slope /= 2 * tiny
        move = slope * (value / np.maximum((slope**2).sum(axis=1), 1e-12))[:, None]
        length = np.linalg.norm(move, axis=1)[:, None]
        vertices = vertices - move * np.minimum(1, 0.3 * step / np.maximum(length, 1e-12))
    return largest(vertices, faces)


def largest(vertices: np.ndarray, faces: np.ndarray) -> sm.TriangleMesh:
    """Return the largest piece of a triangulation, its holes filled."""
    whole = pv.PolyData.from_regular_faces(vertices, faces).extract_largest().clean()
    filled = whole.fill_holes(whole.length) if whole.n_open_edges else whole
    return sm.TriangleMesh(np.array(filled.points, float), filled.regular_faces).oriented()


def scanned(name: str) -> sm.TriangleMesh:
    """Return a closed surface of the data folder; one of few triangles is subdivided."""
    surface = sm.read_triangles(Path(os.environ["SIMPLEXMESH_DATA"]) / name).welded(report=False)
    vertices, faces = np.array(surface.vertices), np.array(surface.faces)
    if len(faces) < 2000:
        vertices, faces = igl.loop(vertices, faces.astype(np.int64), 3)
    return largest(vertices, faces)


def bodies(seed: int) -> Iterator[tuple[str, sm.TriangleMesh]]:
    """Yield name and surface of each body: those of the data folder, if there is one, and one of each kind drawn."""
    if "SIMPLEXMESH_DATA" in os.environ:
        for name in SCANS:
            yield Path(name).stem, scanned(name)
    for kind in (animal, hand, blobs, knot, relief, casting, rings):
        yield kind.__name__, triangulated(kind(np.random.default_rng(seed)))
