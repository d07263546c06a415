"""Sharp edges and zones of a noisy scan of a part.

A plate with a chamfer, a drilled boss and a dome is scanned with noise of a tenth of an edge, by triangles that know
nothing of its edges. `feature_lines` sees the noise and finds the edges, `zones` cuts the surface along them and says
what each zone is. No angle is given, and no number.
"""

import numpy as np
import pyvista as pv
from scipy.spatial.transform import Rotation

import simplexmesh as sm

NOISE = 0.1  # standard deviation, in mean edges
LENGTH = 6.4 + 6.2 + 0.8 + 1.2 + 0.2 * np.sqrt(2) + 2 * np.pi * (2 * 0.38 + 2 * 0.2 + np.sqrt(0.35**2 - 0.1**2))
TURN = Rotation.from_rotvec([0.5, 0.4, 0.3]).as_matrix()


def main(size="large"):
    """Return a scan of the part, its sharp edges and zones, and the length of the edges beside the true one."""
    scan = noisy(part(0.02 if size == "large" else 0.04))
    network = sm.feature_lines(scan)
    zones = sm.zones(scan, network)
    lengths = sum(line.length for line in network.lines), LENGTH
    return {"scan": scan, "network": network, "zones": zones, "kinds": zones.kinds, "lengths": lengths}


def part(step):
    """Return the surface of the part, sampled on a grid of a step that lies askew to it."""
    low, shape = np.array([-1.3, -1.3, -1.1]), np.ceil(np.array([2.6, 2.6, 2.2]) / step).astype(int)
    x, y, z = np.einsum("ij,j...->i...", TURN, low[:, None, None, None] + step * np.indices(shape))
    plate = np.max([abs(x) - 1.0, abs(y) - 0.6, -z, z - 0.25, (x + z - 1.15) / np.sqrt(2)], axis=0)
    around = np.hypot(x + 0.45, y)
    boss = np.max([around - 0.38, z - 0.5, -z], axis=0)
    dome = np.sqrt((x - 0.42) ** 2 + y**2 + (z - 0.15) ** 2) - 0.35
    solid = np.maximum(np.min([plate, boss, np.maximum(dome, -z)], axis=0), 0.2 - around)
    grid = pv.ImageData(dimensions=shape, spacing=(step, step, step), origin=low)
    grid["solid"] = -solid.ravel(order="F")
    found = grid.contour([0.0])
    return sm.TriangleMesh(found.points @ TURN.T, found.regular_faces).welded(report=False)


def noisy(surface):
    """Return a surface with its vertices moved along their normals, by `NOISE` mean edges."""
    ends = surface.vertices[surface.faces]
    edge = np.linalg.norm(ends - np.roll(ends, 1, axis=1), axis=2).mean()
    errors = NOISE * edge * np.random.default_rng(0).normal(size=(surface.n_vertices, 1))
    return sm.TriangleMesh(surface.vertices + errors * surface.vertex_normals, surface.faces)


def show(out):
    """Draw the scan, and its zones with their edges."""
    scan, zones = out["scan"], out["zones"]
    plotter = sm.plot.stage(columns=2)
    sm.plot.surface(scan, edges=False, title=f"scan: {scan.n_faces:,} triangles", plotter=plotter)
    plotter.subplot(0, 1)
    title = f"{len(out['network'])} sharp edges, {len(zones)} zones"
    sm.plot.features(scan, out["network"], zones, title=title, plotter=plotter)
    return sm.plot.looked_at(plotter, (0.7, -1.0, 0.9))


if __name__ == "__main__":
    result = main()
    print(result["kinds"], result["lengths"])
    show(result).show()
