"""Primitives of boxes, cans and balls on a table before a depth camera, whose noise is alike in pixels side by side.

Run: python tests/benchmarks/bench_depth_camera.py [scenes] [first seed]
"""

from __future__ import annotations

import sys
import time
import warnings
from itertools import product
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter

sys.path.insert(0, str(Path(__file__).parents[2]))

import simplexmesh as sm

WIDTH, HEIGHT, FOCAL, BASELINE = 320, 240, 285.0, 0.075
"""Of the camera: pixels, pixels, meters."""

WHITE, STEP = 0.03, 1 / 16
"""Noise of each pixel's disparity, and its rounding, in pixels."""

WAVES, LENGTHS = (0.025, 0.05, 0.1), (4, 8, 16)
"""Noise of disparities that is alike side by side, and over how many pixels: 2 to 7 mm at 1.2 m."""

FEWEST = 150
"""Points of a shape that is counted."""


class View:
    """What the rays of a camera meet first: how far (n,) in its depth, and which shape (n,), of which kinds."""

    def __init__(self, camera, toward):
        ahead = (toward - camera) / np.linalg.norm(toward - camera)
        right = np.cross(ahead, [0, 0, 1])
        right /= np.linalg.norm(right)
        column, row = np.meshgrid(np.arange(WIDTH) - WIDTH / 2, np.arange(HEIGHT) - HEIGHT / 2)
        rays = ahead + np.stack([column, row], axis=2) / FOCAL @ np.stack([right, np.cross(ahead, right)])
        self.camera, self.rays = camera, rays.reshape(-1, 3)
        self.depth, self.shape = np.full(len(self.rays), np.inf), np.full(len(self.rays), -1)
        self.kinds = []

    def add(self, depth, hit, *kinds, which=0):
        """Add shapes that rays meet at some depth where they hit them; `which` tells of several."""
        nearer = hit & (depth > 0) & (depth < self.depth)
        self.depth[nearer] = depth[nearer]
        self.shape[nearer] = (len(self.kinds) + which * np.ones(len(depth), int))[nearer]
        self.kinds += kinds

    def add_box(self, center, half, turn):
        """Add a box of half sides that is turned about the vertical."""
        frame = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
        origin, rays = (self.camera - center) @ frame, self.rays @ frame
        ends = np.sort([(-half - origin) / rays, (half - origin) / rays], axis=0)
        axis, rows = ends[0].argmax(axis=1), np.arange(len(rays))
        side = 2 * axis + (rays[rows, axis] > 0)
        self.add(ends[0][rows, axis], ends[0].max(axis=1) < ends[1].min(axis=1), *["plane"] * 6, which=side)

    def add_round(self, center, radius, axes):
        """Add a ball, of three axes, or the wall of a cylinder, of two; return the heights at which it is met."""
        origin, rays = (self.camera - center)[:axes], self.rays[:, :axes]
        square, half = (rays**2).sum(axis=1), rays @ origin
        root = half**2 - square * (origin @ origin - radius**2)
        depth = (-half - np.sqrt(np.maximum(root, 0))) / square
        height = self.camera[2] + depth * self.rays[:, 2]
        low, high = (0, 2 * center[2]) if axes == 2 else (-np.inf, np.inf)
        self.add(depth, (root > 0) & (height > low) & (height < high), "cylinder" if axes == 2 else "sphere")

    def add_level(self, height, center=(0.0, 0.0), radius=np.inf):
        """Add a level disc."""
        depth = (height - self.camera[2]) / self.rays[:, 2]
        off = self.camera[:2] + depth[:, None] * self.rays[:, :2] - center
        self.add(depth, np.linalg.norm(off, axis=1) < radius, "plane")


def scene(seed, wave, length):
    """Return points (n, 3), the shape (n,) that each is of, and the kinds of the shapes."""
    rng = np.random.default_rng(seed)
    view = View(rng.uniform(0.8, 1.3) * np.array([0, -0.9, 0.7]), np.array([0, 0.15, 0.05]))
    view.add_level(0.0)
    spots = rng.permutation(list(product((-0.4, -0.13, 0.14, 0.41), (-0.15, 0.15, 0.45))))
    spots = iter(spots + rng.uniform(-0.03, 0.03, spots.shape))
    for _ in range(rng.integers(2, 5)):
        half = np.append(rng.uniform(0.03, 0.11, 2), rng.uniform(0.025, 0.15))
        view.add_box(np.append(next(spots), half[2]), half, rng.uniform(0, np.pi))
    for _ in range(rng.integers(1, 4)):
        spot, radius, height = next(spots), rng.uniform(0.03, 0.07), rng.uniform(0.08, 0.3)
        view.add_round(np.append(spot, height / 2), radius, 2)
        view.add_level(height, spot, radius)
    for _ in range(rng.integers(0, 3)):
        radius = rng.uniform(0.04, 0.09)
        view.add_round(np.append(next(spots), radius), radius, 3)
    waves = gaussian_filter(rng.normal(size=(HEIGHT, WIDTH)), length).ravel()
    noise = wave / waves.std() * waves + WHITE * rng.normal(size=len(waves))
    disparity = STEP * np.round((FOCAL * BASELINE / view.depth + noise) / STEP)
    seen = np.isfinite(view.depth) & (view.depth < 1.9) & (disparity > 0)
    points = view.camera + (FOCAL * BASELINE / disparity[seen])[:, None] * view.rays[seen]
    return points, view.shape[seen], view.kinds


def judged(truth, kinds, found):
    """Return how many planes and rounds there are and are found as such, and how many others were found."""
    counts, used = np.zeros(4, int), set()
    for shape in np.unique(truth):
        mine = truth == shape
        if mine.sum() < FEWEST:
            continue
        flat = kinds[shape] == "plane"
        counts[0 if flat else 2] += 1
        votes = np.bincount(found.labels[mine & (found.labels >= 0)], minlength=1)
        best = int(votes.argmax())
        most_of_it = votes[best] > 0.5 * mine.sum() and (found.labels == best).sum() < 2 * mine.sum()
        if most_of_it and found.primitives[best].kind == kinds[shape]:
            counts[1 if flat else 3] += 1
            used.add(best)
    return np.append(counts, len(found.primitives) - len(used))


def main():
    """Print the counts over scenes of all waves."""
    warnings.simplefilter("ignore")
    count, first = (int(word) for word in (*sys.argv[1:], *("9", "0")[len(sys.argv) - 1 :]))
    kinds_of_waves = list(product(WAVES, LENGTHS))
    for wave, length in kinds_of_waves:
        total, begun = np.zeros(5, int), time.process_time()
        seeds = [seed for seed in range(first, first + count) if kinds_of_waves[seed % 9] == (wave, length)]
        for seed in seeds:
            points, truth, kinds = scene(seed, wave, length)
            total += judged(truth, kinds, sm.extract_primitives(points, rng=seed))
        planes, flat, rounds, round_ones, others = total
        print(
            f"waves of {wave} over {length} pixels: planes {flat} of {planes}, cylinders and balls {round_ones} of "
            f"{rounds}, others {others}, {(time.process_time() - begun) / max(len(seeds), 1):.1f} s",
            flush=True,
        )


if __name__ == "__main__":
    with np.errstate(divide="ignore", invalid="ignore"):
        main()
