"""The step of a reconstruction that gives the model the sharp edges of its data."""

from __future__ import annotations

from simplexmesh.motion.creases.sharpening import sharpened
from simplexmesh.motion.reconstruct.run import Run


def sharpen(run: Run) -> None:
    """Bring edges of a closed model onto the creases of points or triangles, if these have any and nothing tangles."""
    if run.options.creases == "none" or run.data.layered or run.mesh.n_holes or not run.stages[-1].iterations:
        return
    run.report(0.93, "looking for sharp edges")
    found = sharpened(run.mesh, run.data.samples().points, run.target)
    if found is not None:
        run.mesh, run.target, run.creases, run.tangled = found.mesh, found.target, found.creases(), 0
