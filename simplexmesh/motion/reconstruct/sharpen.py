"""The step of a reconstruction that gives the model the sharp edges of its data."""

from __future__ import annotations

import numpy as np

from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh.contours import Contour, numbered
from simplexmesh.motion.creases.sharpening import sharpened, sharpened_volume
from simplexmesh.motion.reconstruct.measure import share_of_area
from simplexmesh.motion.reconstruct.result import LEAST_BARE
from simplexmesh.motion.reconstruct.run import Run
from simplexmesh.motion.targets.isosurface import Isosurface
from simplexmesh.motion.targets.labels import LabelSurface

MOST_POINTS = 40_000
"""Of an isosurface, drawn at random, for its sharp edges."""

MOST_TRIANGLES = 16_000
"""Of a surface whose own edges are looked for: one through its samples has as many, and averages over more."""


def sharpen(run: Run) -> None:
    """Bring edges of a closed model onto the creases of its data, if it has any and nothing tangles; none of labels."""
    target, closed = run.target, not run.mesh.n_holes
    if run.options.creases == "none" or isinstance(target, LabelSurface) or not closed or not run.stages[-1].iterations:
        return
    run.report(0.93, "looking for sharp edges")
    if isinstance(target, Isosurface):
        rows = np.random.default_rng(0).permutation(len(run.points))[:MOST_POINTS]
        found = sharpened_volume(run.mesh, run.points[rows], run.away(run.points)[rows], target)
    else:
        away = run.tree.query(run.mesh.vertices, workers=-1)[0]
        if share_of_area(run.mesh, away > 2 * run.stages[-1].reach) >= LEAST_BARE:
            return  # the rim of a lid is no crease of the data
        points, surface = run.data.samples().points, run.data.source
        own = surface if isinstance(surface, TriangleMesh) and len(surface.faces) < MOST_TRIANGLES else None
        found = sharpened(run.mesh, points, run.away(points), target, own)
    if found is not None:
        run.target, run.creases, run.tangled = found.target, found.creases(), 0
        stale = dict.fromkeys(name for name in found.mesh.contours if name.startswith("crease_"))
        lines = [Contour(found.mesh, line.vertices, line.closed) for line in run.creases]
        run.mesh = numbered(found.mesh.with_contours(**stale), "crease", lines)
