"""The step of a reconstruction that gives the model the sharp edges of its data."""

from __future__ import annotations

from scipy.spatial import cKDTree

from simplexmesh.motion.creases.sharpening import sharpened
from simplexmesh.motion.reconstruct.measure import share_of_area
from simplexmesh.motion.reconstruct.result import LEAST_BARE
from simplexmesh.motion.reconstruct.run import Run


def sharpen(run: Run) -> None:
    """Bring edges of a closed model onto the creases of points or triangles, if these have any and nothing tangles."""
    if run.options.creases == "none" or run.data.layered or run.mesh.n_holes or not run.stages[-1].iterations:
        return
    points = run.data.samples().points
    away = cKDTree(points).query(run.mesh.vertices)[0]
    if share_of_area(run.mesh, away > 2 * run.stages[-1].reach) >= LEAST_BARE:
        return  # the rim of a lid is no crease of the data
    run.report(0.93, "looking for sharp edges")
    found = sharpened(run.mesh, points, run.target)
    if found is not None:
        run.mesh, run.target, run.creases, run.tangled = found.mesh, found.target, found.creases(), 0
