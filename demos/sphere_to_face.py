"""From a sphere to a face: opening a hole.

A sphere is attracted to the scan of a face from outside. Where there is no data a hole is cut, its boundary moves to
that of the scan, and faces are divided where the scan has more detail, as in Delingette 1994, figure 5.6. Run as
a script it also writes an animation. The scan is `fran_face.vtk` of the folder named by `SIMPLEXMESH_DATA` or, without
it, a synthetic face.
"""

import os
from pathlib import Path

import numpy as np

import simplexmesh as sm


def main(size="large"):
    """Fit a sphere to a face step by step, and return the meshes and their distances from the scan."""
    scan = face()
    target = sm.targets.Triangles(scan)
    radius = scan.diagonal / 2
    mesh = sm.sphere(6 if size == "large" else 4, radius=1.1 * radius, center=scan.vertices.mean(axis=0))
    film, shown = [mesh], {"start": mesh}
    mesh = moved(mesh, target, film, 150, rigidity=20, alpha=0.5, beta=0.03, reach=2 * radius)
    mesh = shown["coarse"] = moved(mesh, target, film, 100, rigidity=6, beta=0.1, reach=0.4 * radius)
    opened = sm.open_holes(mesh, target, fewest=10)
    mesh = shown["opened"] = moved(opened.mesh, target, film, 60, rigidity=6, reach=0.4 * radius)
    most = 1700 if size == "large" else 500
    watch = lambda _, state: film.append(state)  # noqa: E731
    refined = sm.refine(mesh, target, vertices=most, threshold="fine", reach=0.16 * radius, watch=watch)
    mesh = shown["refined"] = moved(refined.mesh, target, film, 60, beta=0.4, reach=0.05 * radius)
    percent = {name: 100 * mean_distance(step, scan) / scan.diagonal for name, step in shown.items()}
    return {"scan": scan, "meshes": shown, "percent": percent, "film": film, "proposals": opened.proposals}


def moved(mesh, target, film, iterations, **options):
    """Run the deformable model, and append every tenth state to the film."""
    model = sm.DeformableModel(mesh, target, **options)
    for state in model.run(iterations, warnings=False):  # the back of the face has no data
        if state.iteration % 10 == 0:
            film.append(model.mesh)
    return model.mesh


def mean_distance(mesh, scan):
    """Return the mean distance from the points of the scan to the mesh."""
    return np.abs(sm.targets.Triangles(mesh.triangulated(), oriented=False).closest(scan.vertices)[0]).mean()


def face():
    """Return the scan of a face, oriented outward, or a synthetic one."""
    real = Path(os.environ.get("SIMPLEXMESH_DATA", "")) / "fran_face.vtk"
    if real.is_file():
        scan = sm.read_triangles(real)
        return sm.TriangleMesh(scan.vertices, scan.faces[:, ::-1])  # its triangles are oriented inward
    across, up = np.meshgrid(np.linspace(-1.25, 1.25, 61), np.linspace(-1.3, 1.3, 81))
    depth = 1.0 + sum(
        height * np.exp(-(((across - x) / width) ** 2) - ((up - y) / tall) ** 2)
        for height, x, y, width, tall in [
            *((0.30, 0.0, -0.10, 0.14, 0.16), (0.16, 0.0, 0.15, 0.12, 0.30)),  # the nose
            *((-0.14, -0.38, 0.28, 0.20, 0.12), (-0.14, 0.38, 0.28, 0.20, 0.12)),  # the eyes
            *((0.06, -0.38, 0.26, 0.12, 0.08), (0.06, 0.38, 0.26, 0.12, 0.08)),
            *((0.09, 0.0, -0.50, 0.26, 0.06), (0.09, 0.0, -0.64, 0.22, 0.06), (0.12, 0.0, -0.95, 0.25, 0.18)),
        ]
    )
    x, y, z = np.sin(across) * np.cos(0.6 * up), 1.25 * np.sin(up), np.cos(across) * np.cos(0.6 * up)
    points = np.stack([0.8 * x * depth, y * depth, 0.9 * z * depth], axis=-1).reshape(-1, 3)
    first = (np.arange(80)[:, None] * 61 + np.arange(60)).ravel()
    corners = [[first, first + 1, first + 62], [first, first + 62, first + 61]]
    return sm.TriangleMesh(points, np.concatenate([np.stack(three, axis=1) for three in corners]))


def front(scan):
    """Return the direction from the face to the camera."""
    normal = scan.face_vectors.sum(axis=0)
    return tuple(normal / np.linalg.norm(normal) + [0.0, 0.1, 0.0])


def show(out):
    """Draw the scan and the steps in panels."""
    percent = out["percent"]
    steps = {name: mesh for name, mesh in out["meshes"].items() if name != "start"}
    titles = {f"{name}: mean distance {percent[name]:.2g} %": mesh for name, mesh in steps.items()}
    return sm.plot.panels({"scan": out["scan"], **titles}, view=front(out["scan"]), up="y")


def write_film(out, path):
    """Write the animation as a .gif or .mp4 file."""
    import pyvista as pv

    plotter = pv.Plotter(off_screen=True, window_size=(640, 640))
    if Path(path).suffix == ".gif":
        plotter.open_gif(str(path), fps=12)
    else:
        plotter.open_movie(str(path), framerate=12)
    look = np.array(front(out["scan"]))
    for place, mesh in enumerate(out["film"]):
        plotter.clear_actors()
        plotter.add_mesh(mesh.to_pyvista(), color="#d8b898", show_edges=True, edge_color="#604830")
        turn = 0.5 * np.sin(2 * np.pi * place / len(out["film"]))
        side = np.cross([0.0, 1.0, 0.0], look)
        center = out["scan"].vertices.mean(axis=0)
        eye = center + 3.2 * out["scan"].diagonal * (np.cos(turn) * look + np.sin(turn) * side)
        plotter.camera_position = [eye, center, (0.0, 1.0, 0.0)]
        plotter.reset_camera_clipping_range()
        plotter.write_frame()
    plotter.close()


if __name__ == "__main__":
    result = main()
    print(result["percent"], result["meshes"]["refined"])
    write_film(result, "sphere_to_face.gif")
    show(result).show()
