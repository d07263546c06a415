"""The first and the last motion of a reconstruction, both followed by untangling."""

from __future__ import annotations

from simplexmesh.mesh.operators.regularize import regularize
from simplexmesh.motion.model.boundary_unfold import unfolded_boundary
from simplexmesh.motion.reconstruct.run import Run


def settle(run: Run) -> None:
    """Move stiffly towards the data, unless the mesh is to be wrapped around it; untangle a start found near it."""
    if run.surface is not None:
        return
    stiff = run.stages[:-2]
    run.move(*stiff, until=0.25)
    if run.fallback is not None:
        run.untangle(stiff[-1].reach)


def finish(run: Run) -> None:
    """Even out face sizes where refinement left others than five to seven, move to rest, and untangle."""
    last = run.stages[-1]
    if run.options.refine != "none":
        even = regularize(run.mesh)
        if even.swaps:
            run.mesh, run.fallback = even.mesh, None
            run.count(swapped=even.swaps)
    run.move(last, until=1.0)
    run.report(0.92, "untangling")
    left = run.untangle(last.reach)
    run.mesh, run.tangled = unfolded_boundary(run.mesh) if run.mesh.n_holes else run.mesh, left
