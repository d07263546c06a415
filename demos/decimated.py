"""A surface of marching cubes, with a twentieth of its vertices, and a hundredth.

Marching cubes make triangles as small where the surface is flat as where it bends. In their dual, decimated, faces grow
where it bends little, and stay small where it bends much. This is the liver of the frog that PyVista brings.
"""

import time

import numpy as np
import pyvista as pv
from pyvista import examples

import simplexmesh as sm

LIVER, KIDNEY = 10, 8


def main(size="large"):
    """Decimate the dual of an organ's isosurface, and say how far each model is from it."""
    full = marching_cubes(LIVER if size == "large" else KIDNEY)
    models, seconds = {"marching cubes": full}, {}
    away = {}
    for part in (20, 100) if size == "large" else (10, 40):
        began = time.perf_counter()
        out = sm.decimate(full, vertices=2 * round(full.n_vertices / (2 * part)))
        name = f"1/{part}"
        models[name], seconds[name] = out.mesh, time.perf_counter() - began
        away[name] = {"rms": out.rms, "largest": out.largest, "exceptions": len(out.exceptions)}
    diagonal = float(np.linalg.norm(np.ptp(full.bounds, axis=0)))
    return {"models": models, "away": away, "seconds": seconds, "diagonal": diagonal}


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
    """Draw the surface and the models made of it."""
    diagonal = out["diagonal"]
    named = {}
    for name, mesh in out["models"].items():
        away = out["away"].get(name)
        off = f", rms {100 * away['rms'] / diagonal:.2g} % off" if away else ""
        named[f"{name}: {mesh.n_vertices:,} vertices{off}"] = mesh
    return sm.plot.panels(named, view="yx")


if __name__ == "__main__":
    result = main()
    print(result["models"], result["away"], result["seconds"])
    show(result).show()
