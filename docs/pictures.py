"""Draw the pictures of the documentation into images/: `python docs/pictures.py [name ...]`, all without a name.

`SIMPLEXMESH_DATA` names the folder of the files drawn. Those of the benchmark are drawn by `docs/benchmark.py`,
`decimated` and `redistributed` by `bench_decimate.py picture` and `bench_refine.py picture` in `tests/benchmarks`.
"""

import contextlib
import importlib
import os
import sys
import tempfile
import warnings
from collections import Counter
from pathlib import Path

os.environ["PYVISTA_OFF_SCREEN"] = "true"
sys.path.insert(0, str(Path(__file__).parents[1] / "demos"))
sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
import pyvista as pv
from PIL import Image
from pyvista import examples
from scipy.spatial import cKDTree

import simplexmesh as sm
from tests.benchmarks import bench_creases, bench_recognize
from tests.recognition import reference as reference

IMAGES = Path(__file__).parent / "images"
DATA = Path(os.environ.get("SIMPLEXMESH_DATA", "data"))
QUALITY = 85  # of the JPEG files

SCANS = {  # file: direction to the camera, and the axis that points up
    "lion_head.off": ((0.5, 0.1, 1.0), (0.0, 1.0, 0.0)),
    "rabbit_scan.vtk": ((-0.3, 0.2, -1.0), (0.0, 1.0, 0.0)),
    "fandisk.off": ((-1.0, 0.8, 0.3), (0.0, 0.0, 1.0)),
    "femur.off": ((0.7, -1.0, -0.1), (0.0, 0.0, -1.0)),
    "fran_face.vtk": ((1.0, 0.05, -0.6), (0.0, 1.0, 0.0)),
}
VIEWS = {  # the single views that are recognized, in the same way
    "elephant": ((1.0, 0.35, 0.6), (0.0, 1.0, 0.0)),
    "spot": ((0.8, 0.35, -1.0), (0.0, 1.0, 0.0)),
    "mannequin": ((0.8, -1.0, 0.3), (0.0, 0.0, 1.0)),
}
PARTS = {  # parts and scans whose sharp edges and zones are shown, likewise
    "fandisk.off": ((0.7, -1.0, 0.6), (0.0, 0.0, 1.0)),
    "anchor.off": ((0.7, -1.0, 0.75), (0.0, 0.0, 1.0)),
    "coupling.off": ((0.7, -1.0, 0.8), (0.0, 0.0, 1.0)),
    "featuretype.stl": ((0.7, -1.0, 0.75), (0.0, 0.0, 1.0)),
    "fixed_top.ply": ((0.7, -1.0, 0.75), (0.0, 0.0, 1.0)),
    "tray_bottom.stl": ((0.5, -0.8, 1.0), (0.0, 0.0, 1.0)),
    "abc8.stl": ((0.7, -1.0, 0.75), (0.0, 0.0, 1.0)),
    "part_scan.ply": ((0.3, 0.3, -1.0), (0.0, 1.0, 0.0)),
    "rabbit_scan.vtk": ((-0.3, 0.2, -1.0), (0.0, 1.0, 0.0)),
}
CLOUDS = {  # a part and three views of depth cameras whose primitives are shown: likewise, and what is told of them
    "abc_00949.xyzc": ((0.7, -1.0, 0.75), (0.0, 0.0, 1.0), {}),
    "osd_learn37.pcd": ((0.3, -0.7, -1.0), (0.0, -1.0, 0.0), {"kinds": ("plane", "cylinder")}),
    "ros_table.pcd": ((-0.6, -1.0, 0.8), (0.0, 0.0, 1.0), {"kinds": ("plane",)}),
    "box_rgbd.ply": ((0.3, 0.4, 1.0), (0.0, 1.0, 0.0), {"kinds": ("plane",)}),
}
NEAR = np.cos(np.radians(35))  # the scanner is within this angle of the camera, so that its points are visible
NOISE = 0.003  # of the views, as a share of the diagonal
MODEL, SCAN = "#a9bac6", "#c2502e"
PART_COLORS = ("#9fb4c7", "#c2502e", "#5b9a68", "#d9a441", "#8a5a9e", "#3a5f95", "#5aa3b5", "#b8577b", "#7d8a3c")
SCAN_COLORS = ("#c2502e", "#3a5f95", "#5b9a68", "#d9a441", "#8a5a9e", "#5aa3b5")


def scan(file):
    """Return a surface rotated to axes right, up and toward the camera."""
    mesh = sm.read_triangles(DATA / file)
    if file == "fran_face.vtk":  # its triangles are oriented inward
        mesh = sm.TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])
    return mesh.transformed(picture_axes(*SCANS[file]))


def adaptive():
    """Mean curvature of two scans and a CAD model, with default parameters."""
    titles = {"lion_head.off": "lion's head", "rabbit_scan.vtk": "toy, depth camera", "fandisk.off": "fandisk"}
    plotter = sm.plot.stage(columns=len(titles))
    for column, (file, title) in enumerate(titles.items()):
        plotter.subplot(0, column)
        mesh = scan(file)
        name = "mean curvature H" + " " * column  # panels with the same name would share one scale
        sm.plot.heat(mesh, sm.curvature(mesh).mean, name=name, title=title, plotter=plotter)
    return [sm.plot.looked_at(plotter, "xy")]


def features():
    """Sharp edges and zones of parts, and of two scans by depth cameras, with default parameters."""
    rows = []
    for place, (file, (toward, up)) in enumerate(PARTS.items()):
        column = place % 3
        if column == 0:
            rows.append(sm.plot.stage(columns=3, size=(1800, 560)))
        mesh = sm.read_triangles(DATA / file)
        T = picture_axes(toward, up)
        middle = mesh.transformed(T).bounds.mean(axis=0)
        T[:3, 3] = -middle
        mesh = mesh.transformed(T).scaled(1 / mesh.diagonal)
        zones = sm.zones(mesh)
        title = f"{Path(file).stem}: {len(zones)} zone{'s' if len(zones) > 1 else ''}"
        rows[-1].subplot(0, column)
        sm.plot.features(mesh, None, zones, title=title, plotter=rows[-1])
    return [sm.plot.looked_at(row, "xy") for row in rows]


def primitives():
    """Points of a part and of three views of depth cameras, in a color for each primitive."""
    rows = []
    for place, (file, (toward, up, told)) in enumerate(CLOUDS.items()):
        column = place % 2
        if column == 0:
            rows.append(sm.plot.stage(columns=2, size=(1500, 620)))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", sm.SimplexMeshWarning)  # pixels without a depth are left out
            cloud = sm.read_points(DATA / file).transformed(picture_axes(toward, up))
        size = float(np.linalg.norm(np.ptp(cloud.bounds, axis=0)))
        cloud = sm.PointCloud((cloud.points - cloud.bounds.mean(axis=0)) / size)
        found = sm.extract_primitives(cloud, **told)
        counts = Counter(each.kind for each in found.primitives)
        title = f"{Path(file).stem}: " + ", ".join(f"{n} {kind}{'s' if n > 1 else ''}" for kind, n in counts.items())
        rows[-1].subplot(0, column)
        rows[-1].add_text(title, font_size=11, position="upper_edge", color="#26323d")
        for k in np.unique(found.labels):
            color = "#c9ced3" if k < 0 else PART_COLORS[k % len(PART_COLORS)]
            some = cloud.points[found.labels == k]
            rows[-1].add_mesh(some, color=color, point_size=4, render_points_as_spheres=True)
    return [sm.plot.looked_at(row, "xy") for row in rows]


def composed():
    """Noisy points of a beam, a flange and a pair of flanges, and what is fitted to them."""
    P, rng = sm.primitives, np.random.default_rng(0)
    plotter = sm.plot.stage(columns=3, size=(1500, 520))
    for column, (shape, ends) in enumerate(
        [
            (P.Beam([0, 0, 0], [1, 0, 0], 0.16, 0.12, 0.016, 0.012, across=[0, 1, 0]), [[-0.2, 0.2], [0, 0.776]]),
            (P.Flange([0, 0, 0], [1, 0, 0], 0.1, 0.03, 0.05), [[-np.pi, np.pi], [-0.2, 0.18]]),
            (P.FlangePair([0, 0, 0], [1, 0, 0], 0.1, 0.05, 0.05), [[-np.pi, np.pi], [-0.2, 0.35]]),
        ]
    ):
        given = shape.with_fit(P.Fit(0.0, 0.0, np.zeros((shape.n_parameters,) * 2), np.array(ends), 1))
        cloud = given.sampled(9000, rng=rng)
        points = cloud.points + 0.001 * rng.normal(size=(9000, 1)) * cloud.normals
        found = sm.fit_primitive(points, shape.kind)
        plotter.subplot(0, column)
        short = "_thickness" if found.kind == "beam" else ""
        names = [name.removesuffix(short).replace("_", " ") for name in found._measures()]
        sizes = [f"{name} {1000 * size:.1f}" for name, size in zip(names, found._shape, strict=True)]
        lines = "\n".join(", ".join(sizes[k : k + 2]) for k in range(0, len(sizes), 2))
        sm.plot.primitives(points, found, title=f"{found.kind}\n{lines} mm", plotter=plotter)
    return [sm.plot.looked_at(plotter, (0.9, -0.7, 0.6))]


def occlusion():
    """A molar with its cusps, a displaced guide cut in half, and the guide in occlusion, as in guides.md."""
    tooth = sm.reconstruct(DATA / "tooth.nhdr", level=600, vertices=6000).mesh.triangulated("dual")
    play = sm.TriangleMesh(tooth.vertices + 0.5 * tooth.vertex_normals, tooth.faces)
    block = sm.clipped(sm.sphere(12, radius=60, center=(52, 45, 180)), (0, 0, 141), (0, 0, 1), cap=True)
    guide = sm.boolean(sm.clipped(block, (0, 0, 165), (0, 0, -1), cap=True), play)
    turn = np.array([[0.996, -0.087, 0], [0.087, 0.996, 0], [0, 0, 1]])
    displaced = sm.TriangleMesh(guide.vertices @ turn.T + [7, -6, 8], guide.faces)
    put = displaced.transformed(sm.occlude(displaced, tooth, tolerance=1.0).T_target_source)
    gap = np.abs(sm.targets.Triangles(put, oriented=False).closest(tooth.vertices)[0])
    curvature = sm.curvature(tooth)
    cusps = sm.salient_points(tooth, of="mean", curvature=curvature, count=40).points
    cusps = cusps[np.argsort(-cusps[:, 2])[:4]]
    plotter = sm.plot.stage(columns=3, size=(1500, 700))
    sm.plot.heat(tooth, curvature.mean, name="mean curvature (1/voxel)", marks=cusps, plotter=plotter)
    for column, moved in enumerate((displaced, put), 1):
        plotter.subplot(0, column)
        half = sm.clipped(moved, moved.vertices.mean(axis=0), (0, 1, 0), cap=True)
        sm.plot.surface(half, color="#3a5f95", edges=False, plotter=plotter)
        if column == 1:
            sm.plot.surface(tooth, color="#d9cfc0", edges=False, plotter=plotter)
    sm.plot.heat(
        tooth, np.where(gap < 1.0, gap, np.nan), name="gap to the guide (voxels)", limits=(0, 1), plotter=plotter
    )
    return [sm.plot.looked_at(plotter, (0.35, -1.0, 0.55))]


def colors():
    """Colored points of spot, and the model that takes their colors along."""
    cow = sm.read(DATA / "spot.obj").sampled(40_000, rng=0)
    patch = cKDTree(cow.selected(np.arange(60)).points).query(cow.points)[1] % 4
    paint = np.array([[245, 240, 232], [245, 240, 232], [92, 58, 38], [210, 120, 50]], np.uint8)
    cow = cow.with_data(colors=paint[patch])
    made = sm.reconstruct(cow, vertices=6000).mesh
    plotter = sm.plot.stage(columns=2, size=(1500, 640))
    for column, (thing, title) in enumerate([(cow, "40,000 points"), (made, "6,000 vertices")]):
        plotter.subplot(0, column)
        sm.plot.surface(
            thing.transformed(picture_axes(*VIEWS["spot"])), scalars="colors", title=title, edges=False, plotter=plotter
        )
    return [sm.plot.looked_at(plotter, "xy")]


def page(name):
    """Return what the Python block of a page of howto/ leaves behind, by name."""
    text = (IMAGES.parent / "howto" / f"{name}.md").read_text(encoding="utf-8")
    left = {}
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        exec(text.split("```python\n")[1].split("```")[0], left)
    return left


def printed():
    """The voxels of an organ, its model, and the decimated one."""
    left = page("print")
    frog = left["frog"]
    inside = frog.threshold([10, 10], scalars=frog.active_scalars_name).extract_surface(algorithm=None).triangulate()
    voxels = (
        sm.TriangleMesh(inside.points, inside.regular_faces).welded(report=False).scaled(60 / left["liver"].diagonal)
    )
    plotter = sm.plot.stage(columns=3, size=(1500, 560))
    sm.plot.surface(voxels, edges=False, title="voxels", plotter=plotter)
    for column, mesh in enumerate((left["liver"], left["fewer"].mesh), 1):
        plotter.subplot(0, column)
        sm.plot.surface(mesh, title=f"{mesh.n_vertices:,} vertices", plotter=plotter)
    return [sm.plot.looked_at(plotter)]


def compared():
    """A part, and the distances of a worn copy of it."""
    left = page("compare")
    plotter = sm.plot.stage(columns=2, size=(1200, 640))
    sm.plot.surface(left["part"], edges=False, color=MODEL, plotter=plotter)
    plotter.subplot(0, 1)
    sm.plot.heat(left["made"], left["off"].distances, name="distance (voxels)", limits=(-3, 3), plotter=plotter)
    return [sm.plot.looked_at(plotter, (-1, -0.6, 0.6))]


def one_recognized():
    """A scan of half an organ alone, and with the whole one."""
    left = page("recognize")
    plotter = sm.plot.stage(columns=2, size=(1200, 640))
    for column in range(2):
        plotter.subplot(0, column)
        plotter.add_mesh(left["scan"], color=SCAN, point_size=8, render_points_as_spheres=True)
    sm.plot.surface(left["placed"], edges=False, color=MODEL, plotter=plotter)
    return [sm.plot.looked_at(plotter, (0.3, 0.5, -1))]


def counts():
    """A brain with three numbers of vertices."""
    frog = examples.load_frog_tissues()
    models = [sm.reconstruct(frog, label=2, vertices=count).mesh for count in (500, 2000, 8000)]
    plotter = sm.plot.stage(columns=3, size=(1500, 360))
    for column, mesh in enumerate(models):
        plotter.subplot(0, column)
        sm.plot.surface(mesh, title=f"{mesh.n_vertices:,} vertices", plotter=plotter)
    return [sm.plot.looked_at(plotter, "-xz")]


def same_voxels():
    """An organ as the contour of PyVista, the same smoothed, and the model."""
    frog = examples.load_frog_tissues()
    values = (np.asarray(frog.active_scalars).reshape(frog.dimensions, order="F") == 10).astype(float)
    grid = pv.ImageData(dimensions=frog.dimensions, spacing=frog.spacing)
    grid["liver"] = values.ravel(order="F")
    contour = grid.contour([0.5]).connectivity("largest")
    model = sm.reconstruct(grid, level=0.5, vertices=4000).mesh
    shown = {"contour": contour, "smooth_taubin": contour.smooth_taubin(), "reconstruct": model}
    plotter = sm.plot.stage(columns=3, size=(1500, 560))
    for column, (title, mesh) in enumerate(shown.items()):
        plotter.subplot(0, column)
        sm.plot.surface(
            mesh, title=f"{title}: {len(getattr(mesh, 'points', model.vertices)):,} vertices", plotter=plotter
        )
    return [sm.plot.looked_at(plotter)]


def poses():
    """Half of a nearly symmetric part on the whole one: in another pose, and in the one found."""
    part = sm.read(DATA / "coupling.off")
    half = part.sampled(20_000, rng=0).points
    along = np.ptp(half, axis=0).argmax()
    half = half[half[:, along] > np.median(half[:, along])]
    found = sm.register(half, part)
    other = found.poses[0]
    T = found.T_target_source @ np.linalg.inv(other.T_target_source)
    there, titles = (
        sm.PointCloud(half).transformed(other.T_target_source),
        [f"score {p.score:.2f}" for p in (other, found)],
    )
    return [sm.plot.overlay(there, part, T, titles=tuple(titles), view=PARTS["coupling.off"][0])]


def signature():
    """Signature of a whole object."""
    return [sm.plot.signature(sm.sai(DATA / "spot.obj"), fitted=True, up="y")]


def signature_of_a_view():
    """Signature of a single range scan, with hidden parts."""
    return [sm.plot.signature(sm.sai(DATA / "bun000.ply"), fitted=True, up="y")]


def signatures_of_a_knot_and_a_face():
    """Signatures on a torus and on a disc."""
    found = sm.sai(DATA / "knot1.off", 12, topology="torus"), sm.sai(scan("fran_face.vtk"), 12, topology="plane")
    return [sm.plot.signature(each, fitted=True, view="xy") for each in found]


def scans():
    """Six range scans in their own frames, in the poses found, and the model."""
    files = [DATA / f"bun{angle}.ply" for angle in ("000", "045", "090", "180", "270", "315")]
    clouds = [sm.read_points(file) for file in files]
    poses = sm.register_all(files).poses
    placed = [cloud.transformed(T) for cloud, T in zip(clouds, poses, strict=True)]
    plotter = sm.plot.stage(columns=3, size=(1500, 560))
    for column, shown in enumerate((clouds, placed)):
        plotter.subplot(0, column)
        for cloud, color in zip(shown, SCAN_COLORS, strict=True):
            plotter.add_mesh(cloud.points[::4], color=color, point_size=3, render_points_as_spheres=True)
    plotter.subplot(0, 2)
    model = sm.reconstruct(files, poses=poses, vertices=4000).mesh
    sm.plot.surface(model, color=MODEL, edges=False, plotter=plotter)
    return [sm.plot.looked_at(plotter, (0.3, 0.2, 1.0), up="y")]


def recognized():
    """Single views on the models they are recognized as."""
    bodies = bench_recognize.bodies()
    plotter = sm.plot.stage(columns=len(VIEWS), size=(1500, 560))
    with tempfile.TemporaryDirectory() as folder:
        library = bench_recognize.filled(Path(folder) / "bodies.sml", bodies)
        for column, (name, (toward, up)) in enumerate(VIEWS.items()):
            points, model = bodies[name]
            seen = bench_recognize.seen(points, np.random.default_rng(seed_of_view(toward)))
            view, _ = bench_recognize.turned(seen, NOISE, np.random.default_rng(1))
            best = library.recognize(view)[0]
            if best.name != name:
                raise RuntimeError(f"the view of {name} was recognized as {best.name}")
            T = picture_axes(toward, up)
            placed = sm.PointCloud(view).transformed(T @ np.linalg.inv(best.T_target_source))
            plotter.subplot(0, column)
            title = f"{name}, score {best.score:.2f}"
            sm.plot.surface(model.transformed(T), color=MODEL, edges=False, title=title, plotter=plotter)
            plotter.add_mesh(placed.points, color=SCAN, point_size=5, render_points_as_spheres=True)
    return [sm.plot.looked_at(plotter, "xy")]


def seed_of_view(toward):
    """Return the first seed with which `seen` looks from near a direction."""
    toward = np.array(toward) / np.linalg.norm(toward)
    rotations = (reference.random_rotation(np.random.default_rng(seed)) for seed in range(1000))
    return next(seed for seed, rotation in enumerate(rotations) if -rotation[2] @ toward > NEAR)


def picture_axes(toward, up):
    """Return the (4, 4) rotation to axes right, up and toward the camera."""
    toward = np.array(toward) / np.linalg.norm(toward)
    right = np.cross(up, toward)
    right /= np.linalg.norm(right)
    T = np.eye(4)
    T[:3, :3] = right, np.cross(toward, right), toward
    return T


def demo(name, show="show"):
    """Return a function that draws what a demo shows."""

    def draw():
        module = importlib.import_module(name)
        return [getattr(module, show)(module.main())]

    return draw


def scanned_part():
    """Models of a part from its tomography, smooth and with its sharp edges."""
    part = bench_creases.reference("plate", 31)
    volume, plotter = bench_creases.scanned(part, np.random.default_rng(31)), pv.Plotter(shape=(1, 2), border=False)
    for column, creases in enumerate(("none", "auto")):
        model = sm.reconstruct(volume, level=0.5, vertices=8000, creases=creases)
        plotter.subplot(0, column)
        sm.plot.surface(model.mesh, title=f"{len(model.creases)} sharp edges", plotter=plotter)
        plotter.camera_position = [(6.0, -5.0, 4.5), (1.5, 1.0, 0.4), (0, 0, 1)]
        plotter.camera.view_angle = 21
    plotter.window_size = 1800, 800
    return [plotter]


def parts():
    """Two parts of CAD, and their models of 4,000 vertices with their sharp edges."""
    plotter = pv.Plotter(shape=(2, 2), border=False)
    for row, file in enumerate(("featuretype.stl", "abc8.stl")):
        part = sm.read(DATA / file)
        for column, surface in enumerate((part, sm.reconstruct(part, vertices=4000).mesh)):
            plotter.subplot(row, column)
            sm.plot.surface(surface, edges=surface is not part, plotter=plotter)
            plotter.camera_position = "iso"
            plotter.camera.zoom(1.2)
    plotter.window_size = 1800, 1300
    return [plotter]


def four_panels(file):
    """Return a function that draws the curvatures, saliency and surface types of a surface."""
    return lambda: [sm.plot.curvature(scan(file), view="xy")]


PICTURES = {  # name: what draws it, row by row, and its width in pixels
    "adaptive": (adaptive, 1800),
    "colors": (colors, 1200),
    "coming": (same_voxels, 1200),
    "compare": (compared, 1200),
    "composed": (composed, 1500),
    "features": (features, 1500),
    "frog": (demo("frog"), 1200),
    "landscape": (demo("recognition", "show_landscape"), 1080),
    "measure": (lambda: [page("measure")["picture"]], 800),
    "occlusion": (occlusion, 1500),
    "parts": (parts, 1400),
    "poses": (poses, 1000),
    "primitives": (primitives, 1500),
    "print": (printed, 1200),
    "recognize": (one_recognized, 1000),
    "recognized": (recognized, 1500),
    "refinement": (demo("refinement"), 1080),
    "saliency": (four_panels("lion_head.off"), 1800),
    "saliency_of_a_face": (four_panels("fran_face.vtk"), 1800),
    "saliency_of_a_femur": (four_panels("femur.off"), 1800),
    "saliency_of_a_rabbit": (four_panels("rabbit_scan.vtk"), 1800),
    "scanned_part": (scanned_part, 1400),
    "scans": (scans, 1500),
    "signature": (signature, 960),
    "signature_of_a_view": (signature_of_a_view, 960),
    "signatures_of_a_knot_and_a_face": (signatures_of_a_knot_and_a_face, 1000),
    "sphere_to_face": (demo("sphere_to_face"), 1440),
    "sphere_to_torus": (demo("sphere_to_torus"), 1400),
    "vertices": (counts, 1200),
}


def main(names, folder=IMAGES):
    for name in names or PICTURES:
        draw, width = PICTURES[name]
        rows = []
        for plotter in draw():
            rows.append(plotter.screenshot(return_img=True))
            plotter.close()
        image = Image.fromarray(np.concatenate(rows))
        image = image.resize((width, round(width * image.height / image.width)), Image.Resampling.LANCZOS)
        image.save(folder / f"{name}.jpg", quality=QUALITY, optimize=True)
        print(f"{name}: {(folder / name).with_suffix('.jpg').stat().st_size / 1000:.0f} kB", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
