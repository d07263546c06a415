"""A torus from noisy points.

The input is points without normals, with noise of 1 % of the diagonal; no parameter is set. The initial mesh already
has the handle, and the fit averages out the noise without shrinking the tube.
"""

import numpy as np

import simplexmesh as sm

RADIUS, TUBE = 1.0, 0.35


def main(size="large"):
    """Sample a torus, add noise, reconstruct, and return the mean distance to the truth in % of the diagonal."""
    points, vertices = (20_000, 3000) if size == "large" else (5_000, 600)
    rng = np.random.default_rng(0)
    exact = sm.torus(400, 140, radius=RADIUS, tube_radius=TUBE).triangulated().sampled(points, rng=rng)
    scan = sm.PointCloud(exact.points + rng.normal(scale=0.01 * exact.diagonal, size=exact.points.shape))
    result = sm.reconstruct(scan, vertices=vertices)
    x, y, z = result.mesh.vertices.T
    error = np.abs(np.hypot(np.hypot(x, y) - RADIUS, z) - TUBE)
    percent = float(100 * error.mean() / exact.diagonal)
    return {"scan": scan, "mesh": result.mesh.with_data(distance_to_truth=error), "percent": percent}


def show(out):
    """Draw the points, the model, and its distance to the truth."""
    plotter = sm.plot.stage(columns=3)
    sm.plot.surface(out["scan"], title=f"{len(out['scan']):,} points, 1 % noise", plotter=plotter)
    plotter.subplot(0, 1)
    sm.plot.surface(out["mesh"], title=f"model, {out['mesh'].n_vertices:,} vertices", plotter=plotter)
    plotter.subplot(0, 2)
    title = f"distance to the truth, mean {out['percent']:.2f} %"
    sm.plot.surface(out["mesh"], scalars="distance_to_truth", title=title, edges=False, plotter=plotter)
    return sm.plot.looked_at(plotter, (0.5, -1.0, 0.9))


if __name__ == "__main__":
    show(main()).show()
