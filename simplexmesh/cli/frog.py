"""The frog: its organs from a labelled magnetic resonance volume, and one of them again from a noisy scan.

The volume, 500 x 470 x 136 samples, comes with PyVista; its labels are those of the frog of the *VTK User's Guide*
(1 blood, 2 brain, 3 duodenum, 4 retina, 5 white of the eye, 6 heart, 7 ileum, 8 kidney, 9 large intestine, 10 liver,
11 lung, 12 nerve, 13 skeleton, 14 spleen, 15 stomach). The demo lives here, and not in `demos/`, so that an installed
package has it; `demos/frog.py` and `make demo` run it.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

import simplexmesh as sm
from simplexmesh.cli.report import dumped
from simplexmesh.motion.targets.triangles import surface_distance

Report = Callable[[float, str], None]

# organ: label, vertices, pieces
ORGANS = {
    "heart": (6, 2000, "largest"),
    "liver": (10, 5000, "largest"),
    "stomach": (15, 15_000, "largest"),
    "lung": (11, 3000, "all"),
    "kidney": (8, 2500, "largest"),
    "large intestine": (9, 2500, "largest"),
    "ileum": (7, 2500, "all"),
    "duodenum": (3, 2500, "largest"),
    "spleen": (14, 600, "largest"),
    "brain": (2, 2000, "largest"),
    "retina": (4, 5000, "all"),
    "skeleton": (13, 40_000, "all"),
}
COLORS = {
    "heart": "#c0392b",
    "liver": "#8e4b3a",
    "stomach": "#d9a066",
    "lung": "#d98f9f",
    "kidney": "#9c5b7d",
    "large intestine": "#7d9d5c",
    "ileum": "#a9b665",
    "duodenum": "#c9b458",
    "spleen": "#5b4a8a",
    "brain": "#88b7c9",
    "retina": "#3c5a78",
    "skeleton": "#d8cdb4",
}
UNSEEN = ("spleen",)  # it lies under others from every side
SEALED = {"stomach": 4.0, "retina": 12.0, "skeleton": 0.0}  # tunnels that are noise
SCANNED = "liver"
SMALL = {"kidney": (8, 400, "largest"), "spleen": (14, 200, "largest")}
NOISE = 0.005  # standard deviation of the scan's noise, in parts of its diagonal


def main(size: str = "large", progress: Report | None = None) -> dict[str, Any]:
    """Reconstruct the organs, then one of them from a simulated scan.

    Parameters
    ----------
    size : {"large", "small"}
        Twelve organs, or two small ones.
    progress : callable, optional
        Called with the share done and a message.

    Returns
    -------
    dict
        "organs", a Reconstruction by name; "scanned", the name of the organ scanned; "scan", its points; "again", the
        Reconstruction of these; "truth", distances from the vertices of that to the organ's surface; "seconds".
    """
    organs, scanned, points = (ORGANS, SCANNED, 20_000) if size == "large" else (SMALL, "kidney", 4_000)
    report = progress or (lambda fraction, message: None)
    volume = frog()
    found: dict[str, Any] = {}
    seconds: dict[str, float] = {}
    for place, (name, (label, vertices, components)) in enumerate(organs.items()):
        report(place / (len(organs) + 1), name)
        began = time.perf_counter()
        with notes_of(name):
            found[name] = sm.reconstruct(
                volume, label=label, vertices=vertices, components=components, tunnels=SEALED.get(name)
            )
        seconds[name] = time.perf_counter() - began
    report(len(organs) / (len(organs) + 1), f"{scanned} from a noisy scan")
    began = time.perf_counter()
    surface = found[scanned].mesh.triangulated(method="fan")
    scan = noisy_scan(surface, points)
    with notes_of(f"{scanned} from the scan"):
        again = sm.reconstruct(scan, vertices=organs[scanned][1])
    seconds["again"] = time.perf_counter() - began
    truth = surface_distance(again.mesh.vertices, surface.vertices, surface.faces)
    report(1.0, "done")
    return {"organs": found, "scanned": scanned, "scan": scan, "again": again, "truth": truth, "seconds": seconds}


@contextmanager
def notes_of(name: str) -> Iterator[None]:
    """Let warnings say what they are about."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", sm.SimplexMeshWarning)
        yield
    for one in caught:
        if issubclass(one.category, sm.SimplexMeshWarning):
            warnings.warn(f"{name}: {one.message}", sm.SimplexMeshWarning, stacklevel=3)
        else:
            warnings.warn_explicit(one.message, one.category, one.filename, one.lineno)


def frog() -> Any:
    """Return the labelled volume of the frog that PyVista brings."""
    import pyvista
    from pyvista import examples

    image = examples.load_frog_tissues()
    assert isinstance(image, pyvista.ImageData)
    values = np.asarray(image.active_scalars).reshape(image.dimensions, order="F")
    return sm.Volume(values, image.spacing, image.origin)


def noisy_scan(surface: Any, points: int, noise: float = NOISE, seed: int = 0) -> Any:
    """Return points sampled evenly from a surface and moved by Gaussian noise, without normals.

    Parameters
    ----------
    surface : TriangleMesh
        What is scanned.
    points : int
        How many.
    noise : float
        Standard deviation along each axis, in parts of the diagonal of the surface's bounding box.
    seed : int
        Of the random numbers.
    """
    rng = np.random.default_rng(seed)
    exact = surface.sampled(points, rng=rng).points
    return sm.PointCloud(exact + rng.normal(scale=noise * surface.diagonal, size=exact.shape))


def numbers(out: Mapping[str, Any]) -> dict[str, Any]:
    """Return what `main` found as plain numbers, for the report."""
    from simplexmesh.cli.reconstruct import described

    organs = {
        name: described(result) | {"seconds": round(out["seconds"][name], 2)} for name, result in out["organs"].items()
    }
    again = out["again"]
    truth, diagonal = out["truth"], float(np.linalg.norm(np.ptp(out["organs"][out["scanned"]].mesh.bounds, axis=0)))
    return {
        "organs": organs,
        "scan": {
            "of": out["scanned"],
            "points": len(out["scan"]),
            "noise": NOISE * diagonal,
            "model": described(again) | {"seconds": round(out["seconds"]["again"], 2)},
            "mean_distance_to_truth": float(truth.mean()),
            "mean_distance_to_truth_percent_of_diagonal": float(100 * truth.mean() / diagonal),
        },
    }


def show(out: Mapping[str, Any]) -> Any:
    """Return a plotter with the organs that can be seen, the bones half transparent."""
    organs = out["organs"]
    seen = {name: result for name, result in organs.items() if name not in UNSEEN or len(organs) < len(ORGANS)}
    return sm.plot.together(
        {name: result.mesh for name, result in seen.items()},
        colors=[COLORS[name] for name in seen],
        opacity={"skeleton": 0.35},
        view="yx",
    )


def show_scan(out: Mapping[str, Any]) -> Any:
    """Return a plotter with the scan, the model made of it, and its distance to the organ it was taken of."""
    model = out["again"].mesh
    plotter = sm.plot.stage(columns=3)
    named = f"model, {model.n_vertices:,} vertices"
    sm.plot.surface(out["scan"], title=f"scan of the {out['scanned']}, {len(out['scan']):,} points", plotter=plotter)
    plotter.subplot(0, 1)
    sm.plot.surface(model, title=named, color=COLORS[out["scanned"]], plotter=plotter)
    plotter.subplot(0, 2)
    colored = model.with_data(distance_to_truth=out["truth"])
    sm.plot.surface(colored, title="distance to the truth", scalars="distance_to_truth", edges=False, plotter=plotter)
    return sm.plot.looked_at(plotter, "yx")


def written(out: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Write models, report and pictures to a folder, and return the report."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, result in out["organs"].items():
        result.mesh.save(folder / f"{name.replace(' ', '_')}.vtp")
    out["again"].mesh.save(folder / f"{out['scanned']}_from_scan.vtp")
    facts = numbers(out)
    (folder / "report.json").write_text(dumped(facts) + "\n", encoding="utf-8")
    (folder / "report.md").write_text(told(facts), encoding="utf-8")
    sm.plot.picture(folder / "frog.png", show(out))
    sm.plot.picture(folder / f"{out['scanned']}_from_scan.png", show_scan(out))
    return facts


def told(facts: Mapping[str, Any]) -> str:
    """Return the report as Markdown."""
    lines = [
        "# The frog",
        "",
        "![The organs](frog.png)",
        "",
        "| organ | vertices | genus | pieces | rms mesh to data | rms data to mesh | seconds |",
        "|---|---:|---:|---:|---:|---:|---:|",
    ]
    for name, organ in facts["organs"].items():
        distance = organ["distance"]
        lines.append(
            f"| {name} | {organ['vertices']:,} | {organ['genus']} | {organ['components']} "
            f"| {distance['mesh_to_data']['rms']:.3f} | {distance['data_to_mesh']['rms']:.3f} "
            f"| {organ['seconds']:.1f} |"
        )
    scan = facts["scan"]
    lines += [
        "",
        "Lengths are in the unit of the volume, the width of a voxel in the slice.",
        "",
        f"## The {scan['of']} again, from a noisy scan",
        "",
        f"![Scan, model, distance]({scan['of']}_from_scan.png)",
        "",
        f"{scan['points']:,} points with noise of standard deviation {scan['noise']:.2f}, without normals, gave a "
        f"model of {scan['model']['vertices']:,} vertices and genus {scan['model']['genus']}; its vertices are "
        f"{scan['mean_distance_to_truth']:.2f} from the {scan['of']}'s surface in the mean, "
        f"{scan['mean_distance_to_truth_percent_of_diagonal']:.2f} % of its diagonal "
        f"({scan['model']['seconds']:.1f} s).",
        "",
    ]
    return "\n".join(lines)
