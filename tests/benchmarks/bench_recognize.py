"""Which model of a library a scan shows: how often `ModelLibrary` says it, and how long it takes.

Run: SIMPLEXMESH_DATA=... python tests/benchmarks/bench_recognize.py [queries] [bodies|views|many|index] [--store]

bodies: 13 bodies of one size (ten of the data folder, the kitten's points, the fused bunny, PyVista's ant); so many
queries of each, 5,000 points sampled anew without normals, turned; "70 %" keeps one side of a random plane; noise in
shares of the diagonal; beside the peers of `recognition_peers`. views: what one depth camera sees of them from a random
side, hidden points removed by a z-buffer. many: a library of 510: the 17 closed meshes of the data folder, and of each
29 more bent smoothly at random, by 4 % of the diagonal in the root mean square; a fifth of a hundred times so many
queries, of models chosen at random. index: in which place the right model of the 510 is by what is compared before any
pose, printed in Markdown.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import simplexmesh as sm
from simplexmesh.recognition.library.global_descriptor import global_descriptor
from simplexmesh.recognition.library.scene import Scene
from simplexmesh.recognition.register.oriented_points import oriented_points
from tests.benchmarks import bench_register
from tests.benchmarks.figures import Figures, installed
from tests.benchmarks.recognition_peers import descriptors
from tests.recognition import reference as reference

PROTOCOL = """Thirteen bodies of one size: ten meshes, the kitten's points, the fused bunny, PyVista's ant. Queries:
5,000 points sampled anew without normals, turned at random; a part is one side of a random plane, a view what a
camera sees; noise in shares of the diagonal. Share of queries whose first answer is right, one value for each of five
rounds of the 13 bodies. Peers have no such function: the body with the nearest descriptor of 20,000 of its points, at
the known size. 510 models: 17 closed meshes and 29 smooth deformations of each, by 4 % of the diagonal; rounds of 20
queries."""
DATA = Path(os.environ.get("SIMPLEXMESH_DATA", "data"))
MESHES = ("spot.obj", "elephant.off", "femur.off", "knot1.off", "eight.off", "fandisk.off", "anchor.off",
          "featuretype.stl", "lion_head.off", "mannequin.off")  # fmt: skip
CLOSED = ("spot.obj", "ellipsoid.off", "torus.stl", "knot1.off", "eight.off", "elephant.off", "femur.off",
          "fandisk.off", "anchor.off", "coupling.off", "featuretype.stl", "angle_block.stl", "fixed_top.ply",
          "tray_bottom.stl", "abc8.stl", "fetal_cortex.vtk", "avf_surface.vtk")  # fmt: skip
SHARES = ((1, 0.002), (1, 0.01), (0.7, 0.005), (0.5, 0.005), (0.35, 0.005))
EACH = 30
BENT = 0.04
COUNT = 5_000
PIXELS = 150


def of_size_one(points: np.ndarray) -> np.ndarray:
    """Return points scaled to a diagonal of one."""
    return points / np.linalg.norm(np.ptp(points, axis=0))


def bodies() -> dict[str, tuple[np.ndarray, object]]:
    """Return dense points of the 13 bodies, and what is put into the library."""
    rng = np.random.default_rng(0)
    found: dict[str, tuple[np.ndarray, object]] = {}
    for name in MESHES:
        mesh = sm.read_triangles(DATA / name)
        mesh = sm.TriangleMesh(of_size_one(mesh.vertices), mesh.faces)
        found[Path(name).stem] = mesh.sampled(150_000, rng=rng).points, mesh
    for name, points in (
        ("kitten", sm.read_points(DATA / "kitten.xyz").points),
        ("bunny", bench_register.bunny()),
        ("ant", bench_register.ant(rng)),
    ):
        points = of_size_one(points)
        found[name] = points, points[rng.permutation(len(points))[:20_000]]
    return found


def turned(points: np.ndarray, noise: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return some of the points, noisy and turned, and the rotation."""
    points = points[rng.permutation(len(points))[:COUNT]]
    points = points + noise * rng.normal(size=points.shape)
    R = reference.random_rotation(rng)
    return points @ R.T + rng.normal(size=3), R


def seen(points: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the points a camera far away sees from a random side: the nearest in each pixel, about a pixel deep."""
    at = points @ reference.random_rotation(rng).T
    size = np.ptp(at[:, :2], axis=0).max() / PIXELS * max(1.0, np.sqrt(60_000 / len(points)))
    pixel = ((at[:, :2] - at[:, :2].min(axis=0)) / size).astype(int)
    nearest = np.full(pixel.max(axis=0) + 3, np.inf)
    np.minimum.at(nearest, tuple((pixel + 1).T), at[:, 2])
    # a surface seen at a slant covers its neighbors' pixels too
    around = np.min(
        [np.roll(nearest, shift, axis=(0, 1)) for shift in ((0, 0), (0, 1), (1, 0), (0, -1), (-1, 0))], axis=0
    )
    return points[at[:, 2] < around[tuple((pixel + 1).T)] + 2 * size]


def asked(figures: Figures, row: str, library: sm.ModelLibrary, queries, rounds: int) -> None:
    """Tell how queries (points, rotation, name) are answered."""
    places, angles, spent, work = [], [], [], []
    for points, R, name in queries:
        began, busy = time.perf_counter(), time.process_time()
        found = library.recognize(points)
        spent.append(time.perf_counter() - began)
        work.append(time.process_time() - busy)
        names = [each.name for each in found]
        places.append(names.index(name) if name in names else 99)
        if places[-1] == 0:
            angles.append(reference.angle(found[0].T_target_source[:3, :3], R))
    answers = np.array(places)
    for what, most in (("first", 1), ("among five", 5)):
        figures.add(f"{row}, {what}", [np.mean(answers[k::rounds] < most) for k in range(rounds)], "of the queries")
    figures.add(f"{row}, median error", [np.median(angles)], "degrees")
    figures.add(f"{row}, processor time", [np.median(work)], "s")
    print(f"{row}: {len(places)} queries, wall-clock median {np.median(spent):.3f} s")


def by_sides(figures: Figures, each: int, folder: Path) -> None:
    """Tell how often bodies are recognized of which one side of a plane is seen, by us and by peers."""
    known = bodies()
    library = filled(folder / "bodies.sml", known)
    rng = np.random.default_rng(5)
    dense = {name: points[rng.permutation(len(points))[:20_000]] for name, (points, _) in known.items()}
    models = {peer: [call(points) for points in dense.values()] for peer, call in PEERS.items()}
    for share, noise in SHARES:
        rng = np.random.default_rng([7, int(100 * share), int(1000 * noise)])
        queries = [(*turned(bench_register.side(points, share, rng), noise, rng), name)
                   for _ in range(each) for name, (points, _) in known.items()]  # fmt: skip
        row = f"13 bodies, {share:.0%} seen, {noise:.1%}"
        in_rounds = [queries[k + 13 * turn] for k in range(13) for turn in range(each)]
        asked(figures, row, library, in_rounds, each)
        for peer, call in PEERS.items():
            right = []
            for points, _, name in queries:
                own = call(points)
                apart = [np.abs(own - model).sum() for model in models[peer]]
                right.append(list(known)[int(np.argmin(apart))] == name)
            rates = [np.mean(right[13 * k : 13 * (k + 1)]) for k in range(each)]
            figures.add(f"{row}, {peer}, first", rates, "of the queries")
        figures.keep()


def by_views(figures: Figures, each: int, folder: Path) -> None:
    """Tell how often bodies are recognized in single views."""
    known = bodies()
    library = filled(folder / "bodies.sml", known)
    for noise in (0.002, 0.005):
        rng = np.random.default_rng(8)
        queries = ((*turned(seen(points, rng), noise, rng), name)
                   for name, (points, _) in known.items() for _ in range(each))  # fmt: skip
        asked(figures, f"13 bodies, one view, {noise:.1%}", library, queries, each)


def filled(path: Path, known) -> sm.ModelLibrary:
    """Return a library of bodies."""
    library = sm.ModelLibrary(path)
    for name, (_, body) in known.items():
        library.add(name, body, replace=True)
    library.recognize(known["spot"][0][:COUNT])
    return library


def bent(vertices: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return vertices of a body of size one, moved by four waves a little shorter or longer than it."""
    moves = np.zeros_like(vertices)
    for _ in range(4):
        wave = rng.normal(size=3)
        wave *= 2 * np.pi / (np.linalg.norm(wave) * rng.uniform(0.7, 1.5))
        moves += np.sin(vertices @ wave + rng.uniform(0, 2 * np.pi))[:, None] * rng.normal(size=3)
    return of_size_one(vertices + BENT / np.sqrt((moves**2).sum(axis=1).mean()) * moves)


def crowd() -> dict[str, sm.TriangleMesh]:
    """Return the closed meshes, and each bent in many ways."""
    found = {}
    for k, name in enumerate(CLOSED):
        mesh = sm.read_triangles(DATA / name)
        vertices = of_size_one(mesh.vertices)
        for number in range(EACH):
            moved = bent(vertices, np.random.default_rng([k, number])) if number else vertices
            found[f"{Path(name).stem} {number}"] = sm.TriangleMesh(moved, mesh.faces)
    return found


def crowded(folder: Path) -> tuple[sm.ModelLibrary, dict[str, sm.TriangleMesh]]:
    """Return the library of all these, and them; say what adding them took."""
    meshes, library = crowd(), sm.ModelLibrary(folder / "many.sml")
    missing = [name for name in meshes if name not in set(library.names)]
    began = time.perf_counter()
    for name in missing:
        library.add(name, meshes[name])
    if missing:
        spent, size = (time.perf_counter() - began) / len(missing), library.path.stat().st_size / len(meshes)
        print(f"\n{len(meshes)} models, {1000 * spent:.0f} ms to add one, {size / 1000:.0f} kB each")
    began = time.perf_counter()
    sm.ModelLibrary(library.path).recognize(meshes["spot 0"])
    print(f"first query of a library just opened: {time.perf_counter() - began:.2f} s")
    library.recognize(meshes["spot 0"])
    return library, meshes


def of_many(figures: Figures, hundreds: int, folder: Path) -> None:
    """Tell how often one of 510 models is recognized."""
    library, meshes = crowded(folder)
    for share, noise in SHARES[1:4]:
        rng = np.random.default_rng([9, int(100 * share)])
        names = rng.choice(list(meshes), 100 * hundreds)
        queries = ((*turned(bench_register.side(meshes[name].sampled(30_000, rng=rng).points, share, rng), noise, rng),
                    str(name)) for name in names)  # fmt: skip
        asked(figures, f"510 models, {share:.0%} seen, {noise:.1%}", library, queries, 5)


def by_index(hundreds: int, folder: Path) -> None:
    """Print in which places models are before any pose is known."""
    library, meshes = crowded(folder)
    index, names = library._read(), list(library.names)
    print("\n| index | seen | first | among 5 | among 20 | among 50 | processor ms |\n|---|--:|--:|--:|--:|--:|--:|")
    for share, noise in SHARES[1:4]:
        rng = np.random.default_rng([9, int(100 * share)])
        places: dict[str, list[int]] = {"profile": [], "images": []}
        work: dict[str, list[float]] = {kind: [] for kind in places}
        for name in rng.choice(names, 100 * hundreds):
            points = bench_register.side(meshes[name].sampled(30_000, rng=rng).points, share, rng)
            points, _ = turned(points, noise, rng)
            surface = oriented_points(points, "scan")
            scene = Scene.of(surface)
            kinds = {
                "profile": lambda surface=surface: index.descriptor_distances(global_descriptor(surface)),
                "images": lambda scene=scene: index.image_distances(scene.images, scene.octave),
            }
            for kind, compared in kinds.items():
                busy = time.process_time()
                apart = compared()
                work[kind].append(time.process_time() - busy)
                places[kind].append(int((apart < apart[names.index(name)]).sum()))
        for kind, found in places.items():
            if found:
                shares = " | ".join(f"{np.mean(np.array(found) < most):.2f}" for most in (1, 5, 20, 50))
                print(f"| {kind} | {share:.0%} | {shares} | {1000 * np.median(work[kind]):.0f} |", flush=True)


if __name__ == "__main__":
    warnings.simplefilter("ignore", sm.SimplexMeshWarning)
    each = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    libraries = installed("open3d", "trimesh")
    PEERS = descriptors(libraries)
    figures = Figures("recognize", PROTOCOL, list(libraries))
    wanted = sys.argv[2:] or ["bodies", "views", "many"]
    with tempfile.TemporaryDirectory() as own:
        folder = Path(os.environ.get("SIMPLEXMESH_BENCH_FOLDER", own))  # kept between runs
        if "bodies" in wanted:
            by_sides(figures, each, folder)
        if "views" in wanted:
            by_views(figures, each, folder)
        if "many" in wanted:
            of_many(figures, max(1, each // 5), folder)
        if "index" in wanted:
            by_index(max(1, each // 5), folder)
        figures.keep()
