"""Reconstruction of organs of a frog from a labeled magnetic resonance volume, and of one of them from a noisy scan.

The volume comes with PyVista; its labels are those of the *VTK User's Guide*. `demos/frog.py` runs this module too.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import simplexmesh as sm
from simplexmesh._base.progress import Progress
from simplexmesh.data.json_text import json_text
from simplexmesh.motion.targets.triangles import surface_distance


class Organ(NamedTuple):
    """Label in the volume, vertices and color of the model, width of tunnels to close."""

    label: int
    vertices: int
    color: str
    tunnels: float | None = None


ORGANS = {
    "heart": Organ(6, 2000, "#c0392b"),
    "liver": Organ(10, 5000, "#8e4b3a"),
    "stomach": Organ(15, 15_000, "#d9a066", tunnels=4.0),
    "lung": Organ(11, 3000, "#d98f9f"),
    "kidney": Organ(8, 2500, "#9c5b7d"),
    "large intestine": Organ(9, 2500, "#7d9d5c"),
    "ileum": Organ(7, 2500, "#a9b665"),
    "duodenum": Organ(3, 2500, "#c9b458"),
    "spleen": Organ(14, 600, "#5b4a8a"),
    "brain": Organ(2, 2000, "#88b7c9"),
    "retina": Organ(4, 5000, "#3c5a78", 12.0),
    "skeleton": Organ(13, 40_000, "#d8cdb4", 0.0),
}
HIDDEN = ("spleen",)  # covered by others from every side
SCANNED = "liver"
SMALL = {"kidney": ORGANS["kidney"]._replace(vertices=400), "spleen": ORGANS["spleen"]._replace(vertices=200)}
NOISE = 0.005
"""Standard deviation of the scan's noise along each axis, as a share of its diagonal."""


def main(size: str = "large", progress: Progress | None = None) -> dict[str, Any]:
    """Reconstruct the organs, then one of them from a simulated scan."""
    organs, scanned, points = (ORGANS, SCANNED, 20_000) if size == "large" else (SMALL, "kidney", 4_000)
    report = progress or (lambda fraction, message: None)
    volume = frog()
    found: dict[str, Any] = {}
    seconds: dict[str, float] = {}
    for place, (name, organ) in enumerate(organs.items()):
        report(place / (len(organs) + 1), name)
        began = time.perf_counter()
        with warnings_prefixed(name):
            found[name] = sm.reconstruct(volume, label=organ.label, vertices=organ.vertices, tunnels=organ.tunnels)
        seconds[name] = time.perf_counter() - began
    report(len(organs) / (len(organs) + 1), f"{scanned} from a noisy scan")
    began = time.perf_counter()
    surface = found[scanned].mesh.triangulated(method="fan")
    scan = noisy_scan(surface, points)
    with warnings_prefixed(f"{scanned} from the scan"):
        again = sm.reconstruct(scan, vertices=organs[scanned].vertices)
    seconds["again"] = time.perf_counter() - began
    truth = surface_distance(again.mesh.vertices, surface.vertices, surface.faces)
    report(1.0, "done")
    return {"organs": found, "scanned": scanned, "scan": scan, "again": again, "truth": truth, "seconds": seconds}


@contextmanager
def warnings_prefixed(name: str) -> Iterator[None]:
    """Prefix warnings with a name."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", sm.SimplexMeshWarning)
        yield
    for one in caught:
        if issubclass(one.category, sm.SimplexMeshWarning):
            warnings.warn(f"{name}: {one.message}", sm.SimplexMeshWarning, stacklevel=3)
        else:
            warnings.warn_explicit(one.message, one.category, one.filename, one.lineno)


def frog() -> Any:
    """Return the labeled volume of the frog that comes with PyVista."""
    import pyvista
    from pyvista import examples

    image = examples.load_frog_tissues()
    assert isinstance(image, pyvista.ImageData)
    values = np.asarray(image.active_scalars).reshape(image.dimensions, order="F")
    return sm.Volume(values, image.spacing, image.origin)


def noisy_scan(surface: Any, points: int, noise: float = NOISE) -> Any:
    """Return points sampled uniformly from a surface, with Gaussian noise and without normals."""
    rng = np.random.default_rng(0)
    exact = surface.sampled(points, rng=rng).points
    return sm.PointCloud(exact + rng.normal(scale=noise * surface.diagonal, size=exact.shape))


def numbers(out: Mapping[str, Any]) -> dict[str, Any]:
    """Return the results of `main` as plain numbers, for the report."""
    from simplexmesh.cli.reconstruct import described

    organs = {
        name: described(result) | {"seconds": round(out["seconds"][name], 2)} for name, result in out["organs"].items()
    }
    again = out["again"]
    truth, diagonal = out["truth"], float(np.linalg.norm(np.ptp(out["organs"][out["scanned"]].mesh.bounds, axis=0)))
    return {
        "unit": "width of a voxel in the slice",
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
    """Return a plotter with the visible organs, the bones semitransparent."""
    organs = out["organs"]
    seen = {name: result for name, result in organs.items() if name not in HIDDEN or len(organs) < len(ORGANS)}
    return sm.plot.together(
        {name: result.mesh for name, result in seen.items()},
        colors=[ORGANS[name].color for name in seen],
        opacity={"skeleton": 0.35},
        view="yx",
    )


def show_scan(out: Mapping[str, Any]) -> Any:
    """Return a plotter with the scan, the model fitted to it, and its distance to the original organ."""
    model = out["again"].mesh
    plotter = sm.plot.stage(columns=3)
    named = f"model, {model.n_vertices:,} vertices"
    sm.plot.surface(out["scan"], title=f"scan of the {out['scanned']}, {len(out['scan']):,} points", plotter=plotter)
    plotter.subplot(0, 1)
    sm.plot.surface(model, title=named, color=ORGANS[out["scanned"]].color, plotter=plotter)
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
    (folder / "report.json").write_text(json_text(facts) + "\n", encoding="utf-8")
    sm.plot.picture(folder / "frog.png", show(out))
    sm.plot.picture(folder / f"{out['scanned']}_from_scan.png", show_scan(out))
    return facts
