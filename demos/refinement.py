"""Adaptive refinement.

A sphere of a few hundred vertices is attracted to a bottle and stays outside of its cavity, for lack of vertices. Faces
that are large, elongated, curved and far from the data are divided, round by round, until none scores above the
threshold: the mesh fills the cavity, with small polygons where curvature is high. Run as a script it also writes an
animation. The bottle is `vase_ct.vti` of the folder named by `SIMPLEXMESH_DATA` or, without it, a synthetic one.
"""

import os
from pathlib import Path

import numpy as np
import pyvista as pv

import simplexmesh as sm

CLAY, INSIDE, LINES, WALL = "#c9d3dc", "#d9a273", "#4a545c", "#8a3b12"


def main(size="large"):
    """Fit a sphere to a bottle coarsely, refine it, and return both meshes and their distances from the bottle."""
    bottle, level = scanned(size)
    target = sm.targets.Isosurface(bottle, level)
    center, radius = middle(bottle, level)
    coarse = sm.sphere(5, radius=1.1 * radius, center=center)
    for far, rigidity, iterations in ((2.0, 6, 100), (0.4, 6, 100), (0.16, 1, 300)):
        model = sm.DeformableModel(coarse, target, reach=far * radius, rigidity=rigidity)
        for _ in model.run(iterations, warnings=False):  # that it stays outside is what is refined below
            pass
        coarse = model.mesh
    film = [coarse]
    refined = sm.refine(coarse, target, threshold="medium", watch=lambda _, mesh: film.append(mesh))
    meshes = {"coarse": coarse, "refined": refined.mesh}
    points = surface_points(bottle, level)
    distance = {name: mean_distance(points, mesh) for name, mesh in meshes.items()}
    film += [refined.mesh]
    return {"meshes": meshes, "distance": distance, "film": film, "rounds": refined.rounds, "size": 2 * radius}


def scanned(size):
    """Return the scan of a bottle and the isovalue of its wall."""
    real = Path(os.environ.get("SIMPLEXMESH_DATA", "")) / "vase_ct.vti"
    if real.is_file() and size == "large":
        return sm.read_volume(real), 25.0
    x, y, z = np.meshgrid(*(np.linspace(-1.7, 1.7, 40) for _ in range(3)), indexing="ij")
    around, up = np.hypot(x, z), y
    wall = 0.5 + 0.5 * np.exp(-(((up + 0.4) / 0.8) ** 4))
    outside = np.minimum(np.minimum(wall - around, 1.5 - up), up + 1.4)
    cavity = np.minimum(wall - 0.28 - around, up + 1.1)
    spacing = x[1, 0, 0] - x[0, 0, 0]
    return sm.Volume(np.minimum(outside, -cavity), spacing=spacing, origin=(-1.7, -1.7, -1.7)), 0.0


def surface_points(volume, level):
    """Return points on the isosurface: the intersections with the grid lines."""
    inside, out = volume.values > level, []
    for axis in range(3):
        ends = [np.moveaxis(volume.values, axis, 0)[cut].astype(float) for cut in (slice(-1), slice(1, None))]
        crossed = np.argwhere(np.moveaxis(inside, axis, 0)[:-1] != np.moveaxis(inside, axis, 0)[1:])
        low, high = (end[tuple(crossed.T)] for end in ends)
        at = crossed.astype(float)
        at[:, 0] += (level - low) / (high - low)
        out.append(volume.to_world(at[:, np.insert([1, 2], axis, 0)]))
    return np.concatenate(out)


def middle(volume, level):
    """Return the center of the object and half its size."""
    low, high = (volume.to_world(end(np.argwhere(volume.values > level), axis=0)) for end in (np.min, np.max))
    return (low + high) / 2, float(np.linalg.norm(high - low) / 2)


def mean_distance(points, mesh):
    """Return the mean distance of points to a mesh."""
    return float(np.abs(sm.targets.Triangles(mesh.triangulated(), oriented=False).closest(points)[0]).mean())


def draw(plotter, mesh):
    """Draw the half of a mesh behind a plane through its center, so that its inside is visible."""
    cut = {"normal": "z", "origin": mesh.bounds.mean(axis=0)}
    fan = mesh.triangulated()
    fan = pv.PolyData.from_regular_faces(fan.vertices, fan.faces)
    lines = pv.PolyData(
        np.array(mesh.vertices), lines=np.insert(mesh.connectivity.edge_vertices.astype(np.int64), 0, 2, axis=1).ravel()
    )
    half = plotter.add_mesh(fan.clip(**cut), color=CLAY, backface_params={"color": INSIDE})
    half.mapper.SetResolveCoincidentTopologyToPolygonOffset()  # so that edges are drawn in front of faces
    half.mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(2.0, 2.0)
    plotter.add_mesh(lines.clip(**cut), color=LINES, lighting=False)
    plotter.add_mesh(fan.slice(**cut), color=WALL, line_width=3, lighting=False)
    plotter.view_vector((0.35, 0.25, 1.0), (0.0, 1.0, 0.0))


def show(out):
    """Draw the coarse mesh and the refined one in panels, cut open."""
    plotter = sm.plot.stage(2)
    for column, (name, mesh) in enumerate(out["meshes"].items()):
        plotter.subplot(0, column)
        draw(plotter, mesh)
        percent = 100 * out["distance"][name] / out["size"]
        title = f"{name}: {mesh.n_vertices} vertices, mean distance {percent:.2g} %"
        plotter.add_text(title, position="upper_edge", font_size=11, color=LINES)
    return plotter


def write_film(out, path):
    """Write the animation as a .gif file."""
    plotter = pv.Plotter(off_screen=True, window_size=(560, 700))
    plotter.open_gif(str(path), fps=3)
    last = out["film"][-1]
    for mesh in [*out["film"], last, last, last]:
        plotter.clear_actors()
        draw(plotter, mesh)
        plotter.add_text(f"{mesh.n_vertices} vertices", font_size=12, color=LINES)
        plotter.write_frame()
    plotter.close()


if __name__ == "__main__":
    result = main()
    print(result["distance"], result["meshes"])
    write_film(result, "refinement.gif")
    show(result).show()
