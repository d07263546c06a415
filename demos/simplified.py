"""A noisy scan of a part, simplified within the noise.

A block with a step and a groove is scanned finely, with noise. Given four standard deviations of it as tolerance,
`simplify` keeps a few of the vertices; all others are within that of the triangles left. Edges lie along the creases.
"""

import warnings

import numpy as np
import pyvista as pv

import simplexmesh as sm

NOISE = 0.002  # standard deviation, in lengths of the block


def main(size="large"):
    """Return a scan of the part, the scan simplified, and the largest distance of the scan's vertices from that."""
    fine = sm.divided(part(), 0.012 if size == "large" else 0.05)
    rng = np.random.default_rng(0)
    errors = np.clip(NOISE * rng.normal(size=fine.n_vertices), -3 * NOISE, 3 * NOISE)
    scan = sm.TriangleMesh(fine.vertices + errors[:, None] * fine.vertex_normals, fine.faces)
    clean = sm.simplify(scan, 4 * NOISE)
    return {"scan": scan, "clean": clean, "largest": sm.deviation(scan, clean).max}


def part():
    """Return a profile with a step and a round groove, extruded."""
    turn = np.linspace(np.pi, 2 * np.pi, 40)
    groove = np.column_stack([0.28 + 0.12 * np.cos(turn), 0.6 + 0.12 * np.sin(turn)])[::-1]
    profile = np.concatenate([[[0, 0], [1, 0], [1, 0.3], [0.6, 0.3], [0.6, 0.6]], groove, [[0, 0.6]]])
    flat = pv.PolyData(np.column_stack([profile, np.zeros(len(profile))]), faces=[len(profile), *range(len(profile))])
    solid = flat.triangulate().extrude((0, 0, 0.5), capping=True).triangulate().clean()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # VTK's caps are turned
        return sm.TriangleMesh(solid.points, solid.regular_faces).oriented()


def show(out):
    """Draw the scan and what is left of it."""
    scan, clean = out["scan"], out["clean"]
    named = {f"scan: {scan.n_faces:,} triangles": scan, f"simplified: {clean.n_faces:,}": clean}
    return sm.plot.panels(named, view=(1.0, 0.9, 1.6), up="y")


if __name__ == "__main__":
    result = main()
    print(result)
    show(result).show()
