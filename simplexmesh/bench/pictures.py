"""Figures of the report: errors over distance, surfaces colored by curvature."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from simplexmesh._base.arrays import Array
from simplexmesh.bench.charts import curves as drawn
from simplexmesh.bench.charts import maps
from simplexmesh.bench.trials.candidates import distance, estimates, truth
from simplexmesh.bench.trials.curve import Curve
from simplexmesh.bench.truth.discretized import Discretized, split_square, torus, uv_sphere
from simplexmesh.bench.truth.graphs import graph
from simplexmesh.bench.truth.noise import noisy
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.surface.sampled_surface import SampledSurface

Picture = tuple[str, str, Callable[[], Any]]
"""File name without suffix, caption, and the function that draws it."""

ERRORS = {"H": ("error of H", (1e-9, 10.0)), "N": ("error of the normal", (1e-10, 1.0))}
"""Label and limits of the axis of errors."""

COLORED = {"H": "mean curvature H", "K": "Gaussian curvature K", "N": "error of the normal"}


def of_curves(curves: Sequence[Curve], surfaces: Sequence[str] | None = None) -> Iterator[Picture]:
    """Yield a figure for each surface, quantity and number of neighbors: error over distance, one panel per scheme."""
    for surface, quantity, count in dict.fromkeys((c.surface, c.quantity, c.count) for c in curves):
        if quantity not in ERRORS or (surfaces is not None and surface not in surfaces):
            continue
        panels: dict[str, dict[str, tuple[Array, Array]]] = {}
        for c in curves:
            if (c.surface, c.quantity, c.count) == (surface, quantity, count):
                panels.setdefault(f"scheme {c.scheme}", {})[c.method] = (c.distances, c.errors)
        label, limits = ERRORS[quantity]
        title = f"{surface.replace('_', ' ')}, {count} neighbors"
        draw = partial(drawn, panels, x_label="distance d", y_label=label, y_limits=limits, title=title)
        yield f"pointwise_{quantity}_{surface}_{count}", f"{label} at the origin of the {title}", draw


def of_surfaces(names: Mapping[str, Sequence[str]], *, few: bool = False) -> Iterator[Picture]:
    """Yield figures of surfaces colored by H or K of each method, or by the error of its normals."""
    saddle, ball = split_square(graph("monkey_saddle"), 32), uv_sphere(32, 32)
    yield _map("H_monkey_saddle", "monkey saddle", saddle, names, (-1.0, 1.0))
    yield _map("N_sphere", "UV sphere", ball, names, (0.0, 0.001))
    if few:
        return
    yield _map("K_sphere", "UV sphere", ball, names, (0.249, 0.251))
    ring = torus(84, 30, irregular=True)
    yield _map("H_torus", "irregular torus", ring, names, (-2.0, 2.0))
    rough = noisy(ring.mesh, 0.1, rng=1)
    yield _map("H_rough_torus", "irregular torus, 10 % noise", ring, names, (-2.0, 2.0), rough)


def _map(
    name: str,
    caption: str,
    made: Discretized,
    names: Mapping[str, Sequence[str]],
    limits: tuple[float, float],
    mesh: TriangleMesh | None = None,
) -> Picture:
    """Return the figure of a quantity, the first letter of the name; exact initial normals unless a mesh is given."""
    quantity, shown = name[0], made.mesh if mesh is None else mesh
    kind = "normals" if quantity == "N" else "curvature"
    normals = made.exact.normals if mesh is None and kind == "curvature" else None

    def draw() -> Any:
        exact = truth(quantity, made.exact)
        panels = [] if quantity == "N" else [("exact", shown, exact)]
        samples = SampledSurface(shown.vertices, shown.faces)
        for method, of, values in estimates(kind, names[kind], samples, normals=normals):
            if of == quantity:
                panels.append((method, shown, distance(values, exact) if quantity == "N" else values))
        return maps(panels, name=COLORED[quantity], limits=limits)

    return f"map_{name}", f"{COLORED[quantity]} of the {caption}, from {limits[0]:g} to {limits[1]:g}", draw
