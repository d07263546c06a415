"""Decimation of a marching-cubes surface to a twentieth and a hundredth of its vertices.

Triangles of marching cubes are equally small in flat and in curved regions. After decimation of their dual, faces are
large where curvature is low and small where it is high. The surface is the liver of the frog that comes with PyVista.
"""

import time

import numpy as np
import pyvista as pv
from pyvista import examples

import simplexmesh as sm

LIVER, KIDNEY = 10, 8


def main(size="large"):
    """Decimate the dual of an organ's isosurface, and return the models and their distances from it."""
    full = marching_cubes(LIVER if size == "large" else KIDNEY)
    models, seconds = {"marching cubes": full}, {}
    distance = {}
    for part in (20, 100) if size == "large" else (10, 40):
        began = time.perf_counter()
        out = sm.decimate(full, vertices=2 * round(full.n_vertices / (2 * part)))
        name = f"1/{part}"
        models[name], seconds[name] = out.mesh, time.perf_counter() - began
        distance[name] = {"rms": out.rms, "largest": out.largest, "exceptions": len(out.exceptions)}
    diagonal = float(np.linalg.norm(np.ptp(full.bounds, axis=0)))
    return {"models": models, "distance": distance, "seconds": seconds, "diagonal": diagonal}


def marching_cubes(label):
    """Return the dual of the isosurface of a label, smoothed by a voxel and a half."""
    frog = examples.load_frog_tissues()
    inside = np.asarray(frog.active_scalars).reshape(frog.dimensions, order="F") == label
    low, high = (end(np.argwhere(inside), axis=0) for end in (np.min, np.max))
    box = np.pad(inside[tuple(map(slice, low, high + 1))], 6).astype(np.float32)
    image = pv.ImageData(dimensions=box.shape, spacing=frog.spacing)
    image["inside"] = box.ravel(order="F")
    smooth = image.gaussian_smooth(std_dev=1.5)
    surface = smooth.contour([0.5], method="flying_edges").connectivity("largest")
    return sm.dual(surface.triangulate().clean())


def show(out):
    """Draw the surface and the decimated models in panels."""
    diagonal = out["diagonal"]
    named = {}
    for name, mesh in out["models"].items():
        distance = out["distance"].get(name)
        rms = f", rms {100 * distance['rms'] / diagonal:.2g} %" if distance else ""
        named[f"{name}: {mesh.n_vertices:,} vertices{rms}"] = mesh
    return sm.plot.panels(named, view="yx")


if __name__ == "__main__":
    result = main()
    print(result["models"], result["distance"], result["seconds"])
    show(result).show()
