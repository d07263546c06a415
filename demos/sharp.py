"""A nut with its sharp edges, from points alone.

A hexagonal nut is sampled at random, with noise. A smooth model rounds its edges, with a bevel one face wide;
`reconstruct` finds the edges in the data by itself, and lays edges of the model along them.
"""

import numpy as np

import simplexmesh as sm

HEIGHT, BORE = 0.8, 0.45
SIDE = 2 / np.sqrt(3)  # of the hexagon, whose sides are at distance 1
NOISE = 0.003
LENGTH = 6 * HEIGHT + 12 * SIDE + 2 * 2 * np.pi * BORE


def main(size="large"):
    """Return points of the nut, models with and without its edges, and the length of the edges beside the true one."""
    many, vertices = (20_000, 4000) if size == "large" else (6000, 1200)
    points = nut(many, np.random.default_rng(0))
    sharp, smooth = (sm.reconstruct(points, vertices=vertices, creases=creases) for creases in ("auto", "none"))
    lengths = sum(line.length for line in sharp.creases), LENGTH
    return {"points": points, "sharp": sharp, "smooth": smooth, "lengths": lengths}


def nut(count, rng):
    """Return points of the nut's surface, uniform but for noise."""
    turn = np.pi / 3 * np.arange(6)
    normals = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    areas = np.array([6 * SIDE * HEIGHT, 2 * np.pi * BORE * HEIGHT, 2 * (3 * SIDE - np.pi * BORE**2)])
    sides, bore, ends = np.rint(count * areas / areas.sum()).astype(int)
    k, across = rng.integers(6, size=sides), rng.uniform(-SIDE / 2, SIDE / 2, (sides, 1))
    flank = normals[k] + across * normals[k] @ [[0, 1], [-1, 0]]
    around = rng.uniform(0, 2 * np.pi, bore)
    plane = rng.uniform(-SIDE, SIDE, (4 * ends, 2))
    plane = plane[((plane @ normals.T).max(axis=1) < 1) & (np.linalg.norm(plane, axis=1) > BORE)][:ends]
    flat = np.concatenate([flank, BORE * np.stack([np.cos(around), np.sin(around)], axis=1), plane])
    height = rng.uniform(0, HEIGHT, len(flat))
    height[-len(plane) :] = HEIGHT * rng.integers(2, size=len(plane))
    return np.column_stack([flat, height]) + NOISE * rng.normal(size=(len(flat), 3))


def show(out):
    """Draw the model without and with its edges."""
    plotter = sm.plot.stage(columns=2)
    sm.plot.surface(out["smooth"].mesh, title="smooth", plotter=plotter)
    plotter.subplot(0, 1)
    sm.plot.surface(out["sharp"].mesh, title=f"{len(out['sharp'].creases)} sharp edges", plotter=plotter)
    return sm.plot.looked_at(plotter, (0.6, -1.0, 1.1))


if __name__ == "__main__":
    result = main()
    print(result["lengths"])
    show(result).show()
