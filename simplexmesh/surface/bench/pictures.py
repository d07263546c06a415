"""Figures of the report: errors over distance and mesh size, surfaces colored by curvature."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.plot.curves import curves as drawn
from simplexmesh.plot.curves import maps
from simplexmesh.plot.stage import picture
from simplexmesh.surface.bench.candidates import RefusedError, curvature_of, normals_of
from simplexmesh.surface.bench.curve import Curve
from simplexmesh.surface.samples import Samples
from simplexmesh.surface.truth import discretized
from simplexmesh.surface.truth.graphs import ARTICLE
from simplexmesh.surface.truth.noise import noisy

Array = NDArray[np.float64]
Picture = tuple[str, str, Callable[[], Any]]
"""File name without suffix, caption, and the function that draws it."""

NAMES = {"H": "error of H", "K": "error of K", "N": "error of the normal"}
LOWEST = {"H": 1e-9, "K": 1e-9, "N": 1e-10}
SIZE = 32


def of_curves(curves: Sequence[Curve], surfaces: Sequence[str] | None = None) -> Iterator[Picture]:
    """Yield a figure for each surface, quantity and number of neighbors: error over distance, one panel per scheme."""
    keys = dict.fromkeys((c.surface, c.quantity, c.count) for c in curves if c.quantity != "K")
    for surface, quantity, count in keys:
        if surfaces is not None and surface not in surfaces:
            continue
        panels: dict[str, dict[str, tuple[Array, Array]]] = {}
        for c in curves:
            if (c.surface, c.quantity, c.count) == (surface, quantity, count):
                panels.setdefault(f"scheme {c.scheme}", {})[c.method] = (c.distances, c.errors)
        caption = f"{surface.replace('_', ' ')}, {count} neighbors"
        name = f"pointwise_{quantity}_{surface}_{count}"
        yield (
            name,
            f"{NAMES[quantity]} at the origin of the {caption}",
            _curves(panels, caption, "distance d", quantity),
        )


def of_sizes(rows: Sequence[dict[str, Any]], kind: str) -> Iterator[Picture]:
    """Yield a figure for each quantity: mean error over the size of one kind of mesh, one panel per surface."""
    for quantity in ("H", "N"):
        panels: dict[str, dict[str, tuple[list[float], list[float]]]] = {}
        for line in rows:
            if line["mesh"] == kind and line["quantity"] == quantity and line["surface"] != "plane":
                panel = panels.setdefault(line["surface"].replace("_", " "), {})
                x, y = panel.setdefault(line["method"], ([], []))
                x.append(2 / line["size"])
                y.append(line["mean error"])
        if panels:
            caption = f"mean {NAMES[quantity]}, {kind}"
            yield f"meshes_{quantity}_{kind}", caption, _curves(panels, kind, "step 2 / m", quantity, columns=4)


def _curves(panels: Mapping[str, Any], title: str, x_label: str, quantity: str, columns: int = 3) -> Callable[[], Any]:
    def draw() -> Any:
        limits = (LOWEST[quantity], 10.0 if quantity == "H" else 1.0)
        y_label = NAMES[quantity]
        return drawn(panels, x_label=x_label, y_label=y_label, y_limits=limits, columns=columns, title=title)

    return draw


def of_surfaces(names: Mapping[str, Sequence[str]], *, few: bool = False) -> Iterator[Picture]:
    """Yield figures of surfaces colored by H or K of each method, or by the error of its normals."""
    curvatures, normals = names["curvature"], names["normals"]
    for surface in ("monkey_saddle",) if few else ("monkey_saddle", "hyperboloid", "cubic", "trigonometric"):
        made = discretized.split_square(ARTICLE[surface], SIZE)
        yield _map(f"H_{surface}", surface, made, "H", curvatures, (-1.0, 1.0))
    ball = discretized.uv_sphere(SIZE, SIZE)
    yield _map("N_sphere", "UV sphere", ball, "N", normals, (0.0, 0.001))
    if few:
        return
    yield _map("H_sphere", "UV sphere", ball, "H", curvatures, (0.499, 0.501))
    yield _map("K_sphere", "UV sphere", ball, "K", curvatures, (0.249, 0.251))
    yield _map("H_cylinder", "UV cylinder", discretized.uv_cylinder(SIZE, SIZE), "H", curvatures, (0.249, 0.251))
    flat = discretized.split_square(ARTICLE["hyperboloid"], SIZE)
    yield _map("N_hyperboloid", "hyperboloid", flat, "N", normals, (0.0, 0.001))
    ring = discretized.torus(84, 30, irregular=True)
    yield _map("H_torus", "irregular torus", ring, "H", curvatures, (-2.0, 2.0))
    rough = noisy(ring.mesh, 0.1, rng=1)
    yield _map("H_rough_torus", "irregular torus, 10 % noise", ring, "H", curvatures, (-2.0, 2.0), rough)


def save(path: Path, plotter: Any) -> None:
    """Write a figure to a file."""
    picture(path, plotter)


def _map(
    name: str,
    caption: str,
    made: discretized.Discretized,
    quantity: str,
    methods: Sequence[str],
    limits: tuple[float, float],
    mesh: TriangleMesh | None = None,
) -> Picture:
    shown = made.mesh if mesh is None else mesh
    what = {"H": "mean curvature H", "K": "Gaussian curvature K", "N": "error of the normal"}[quantity]

    def draw() -> Any:
        samples = Samples(shown.vertices, shown.faces)
        exact = {"H": made.exact.mean, "K": made.exact.gauss}
        panels = [("exact", shown, exact[quantity])] if quantity in exact else []
        for method in methods:
            try:
                panels.append((method, shown, _values(method, samples, made, quantity, given=mesh is None)))
            except RefusedError:
                continue
        return maps(panels, name=what, limits=limits)

    return f"map_{name}", f"{what} of the {caption.replace('_', ' ')}, from {limits[0]:g} to {limits[1]:g}", draw


def _values(method: str, samples: Samples, made: discretized.Discretized, quantity: str, *, given: bool) -> Array:
    """Return a method's values at the vertices, with exact initial normals if `given`."""
    if quantity == "N":
        out: Array = np.linalg.norm(normals_of(method, samples) - made.exact.normals, axis=1)
        return out
    found = curvature_of(method, samples, normals=made.exact.normals if given else None)
    return np.array(found.mean if quantity == "H" else found.gauss)
