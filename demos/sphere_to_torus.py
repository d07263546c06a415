"""From a sphere to a torus: creating a handle.

A sphere is wrapped around points on a torus. Two films span the hole, are pressed against each other, cut out and
joined, automatically. Run as a script it also writes an animation.
"""

import numpy as np
import pyvista as pv

import simplexmesh as sm
from simplexmesh.motion.start.from_points import start_from_points
from simplexmesh.motion.start.primitives import primitive_around
from simplexmesh.motion.topology.wrapping import wrapped

RING, TUBE = 1.0, 0.45
VIEW = (0.3, -1.0, 0.9)
CLAY, LINES = "#c9d3dc", "#4a545c"


def points(count):
    """Return random points, uniformly distributed on a torus."""
    rng = np.random.default_rng(0)
    u, v = rng.uniform(0, 2 * np.pi, (2, 2 * count))
    kept = np.flatnonzero(rng.uniform(size=2 * count) < (RING + TUBE * np.cos(v)) / (RING + TUBE))[:count]
    away = RING + TUBE * np.cos(v[kept])
    return np.stack([away * np.cos(u[kept]), away * np.sin(u[kept]), TUBE * np.sin(v[kept])], axis=1)


def main(size="large"):
    """Wrap a sphere, recording the steps, fit the model, and return its error."""
    vertices, count = (3000, 20_000) if size == "large" else (900, 5000)
    cloud = points(count)
    film = [primitive_around(cloud, "sphere", vertices // 2)]
    wrapped(film[0], start_from_points(sm.PointCloud(cloud)).mesh, vertices=vertices, watch=film.append)
    model = sm.reconstruct(cloud, init="sphere", vertices=vertices)
    film.append(model.mesh)
    x, y, z = model.mesh.vertices.T
    error = np.abs(np.hypot(np.hypot(x, y) - RING, z) - TUBE)
    genus = [mesh.genus for mesh in film]
    return {"film": film, "genus": genus, "error": float(error.max()), "tangled": model.tangled}


def show(out):
    """Draw the sphere, the films on their way and in contact, the tunnel just opened, and the model."""
    film, opened = out["film"], out["genus"].index(1)
    at = {"sphere": 0, "wrapped": opened // 2, "two films": opened - 1, "joined": opened, "model": len(film) - 1}
    return sm.plot.panels({f"{name}: genus {film[k].genus}": film[k] for name, k in at.items()}, view=VIEW)


def write_film(out, path):
    """Write the animation as a .gif or .mp4 file."""
    plotter = pv.Plotter(off_screen=True, window_size=(640, 480))
    if str(path).endswith(".gif"):
        plotter.open_gif(str(path), fps=10)
    else:
        plotter.open_movie(str(path), framerate=10)
    last = out["film"][-1]
    for mesh in [*out["film"], last, last, last, last]:
        plotter.clear_actors()
        plotter.add_mesh(mesh.to_pyvista(), color=CLAY, show_edges=True, edge_color=LINES)
        plotter.add_text(f"genus {mesh.genus}", font_size=12, color=LINES)
        plotter.camera_position = [tuple(4.5 * np.array(VIEW)), (0, 0, 0), (0, 0, 1)]
        plotter.write_frame()
    plotter.close()


if __name__ == "__main__":
    result = main()
    print({name: result[name] for name in ("genus", "error", "tangled")})
    write_film(result, "sphere_to_torus.gif")
    show(result).show()
