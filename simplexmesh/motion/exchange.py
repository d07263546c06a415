"""Redistribution of the vertices of a fitted mesh, as one phase of a reconstruction."""

from __future__ import annotations

from dataclasses import replace

from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.evolve import Stage, mean_edge
from simplexmesh.motion.fit import Fit
from simplexmesh.motion.redistribute import redistribute_round
from simplexmesh.motion.untangle import folded_vertices, tangled_vertices, untangled

EXCHANGES, BETWEEN = 5, 20
"""Maximum number of rounds, and iterations after each."""

WORTH_A_ROUND = 0.01
"""Rounds end when less than this fraction of the faces was merged."""

THIN = 4.5
"""In mean edges: the large faces on both sides of a thinner body would come to intersect."""


def is_thin(mesh: SimplexMesh) -> bool:
    """Return whether the mean thickness of a closed body, twice volume over area, is small in mean edges.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> is_thin(sm.sphere(12)), is_thin(sm.ellipsoid((1.0, 1.0, 0.1), 12))
    (False, True)
    """
    return bool(2 * mesh.volume < THIN * mesh.area * mean_edge(mesh))


def exchange(fit: Fit, stage: Stage) -> None:
    """Alternate rounds of redistribution and motion: pairs of low-scoring faces are merged, high-scoring ones divided.

    Once nothing is tangled only folds are tested for, which is cheap, until the end. If the mesh cannot be untangled
    then, but could be before, all is reverted.
    """
    before = replace(fit)
    motion, wanted, find = replace(stage, iterations=BETWEEN), fit.mesh.n_vertices, tangled_vertices
    for k in range(EXCHANGES):
        tangled = find(fit.mesh)
        find = find if tangled.any() else folded_vertices
        step = redistribute_round(fit.mesh, fit.target, reach=stage.reach, vertices=wanted, tangled=tangled)
        (done,) = step.rounds
        fit.mesh, fit.fallback = step.mesh, None
        fit.add_to_record(exchanged=done.merged, swapped=done.swapped)
        fit.move(motion, share=(0.7 + 0.2 * k / EXCHANGES, 0.7 + 0.2 * (k + 1) / EXCHANGES))
        if done.merged < WORTH_A_ROUND * fit.mesh.n_faces:
            break
    mesh, left = untangled(fit.mesh, fit.target, reach=stage.reach)
    fit.mesh, fit.fallback = mesh, None if left else mesh
    if not left:
        return
    mesh, left = untangled(before.mesh, fit.target, reach=stage.reach, start=before.fallback)
    if not left:  # thin walls, which large faces intersect: revert
        fit.mesh, fit.fallback, fit.record = mesh, mesh, before.record
