"""Vertices of a mesh that has been fitted spent where the data asks for them, as one part of its way."""

from __future__ import annotations

from dataclasses import replace

from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.evolve import Stage, mean_edge
from simplexmesh.motion.journey import Journey
from simplexmesh.motion.redistribute import redistribute_round
from simplexmesh.motion.untangle import folded_vertices, tangled_vertices, untangled

EXCHANGES, BETWEEN = 5, 20
"""Rounds in which faces are merged for others, and iterations after each."""

WORTH_A_ROUND = 0.01
"""Rounds end when less than this share of the faces was exchanged."""


THIN = 4.5
"""In mean edges: large faces on both sides of a thinner body would come to cross each other."""


def thin(mesh: SimplexMesh) -> bool:
    """Return whether a closed body is thin for its mesh: twice volume over area, its mean thickness, in mean edges.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> thin(sm.sphere(12)), thin(sm.ellipsoid((1.0, 1.0, 0.1), 12))
    (False, True)
    """
    return bool(2 * mesh.volume < THIN * mesh.area * mean_edge(mesh))


def exchange(journey: Journey, stage: Stage) -> None:
    """Move and exchange faces by turns: the lowest pairs merge for the highest faces, which are divided.

    Once nothing is tangled only folds are looked for, which costs little; in the end crossings again. Where that leaves
    tangled what was not, all is taken back.
    """
    before = replace(journey)
    turn, wanted, look = replace(stage, iterations=BETWEEN), journey.mesh.n_vertices, tangled_vertices
    for k in range(EXCHANGES):
        tangled = look(journey.mesh)
        look = look if tangled.any() else folded_vertices
        step = redistribute_round(
            journey.mesh, journey.target, reach=stage.reach, vertices=wanted, tangled=tangled
        )  # fmt: skip
        (told,) = step.rounds
        journey.mesh, journey.refuge = step.mesh, None
        journey.counted(exchanged=told.merged, swapped=told.swapped)
        journey.move(turn, share=(0.7 + 0.2 * k / EXCHANGES, 0.7 + 0.2 * (k + 1) / EXCHANGES))
        if told.merged < WORTH_A_ROUND * journey.mesh.n_faces:
            break
    mesh, left = untangled(journey.mesh, journey.target, reach=stage.reach)
    journey.mesh, journey.refuge = mesh, None if left else mesh
    if not left:
        return
    mesh, left = untangled(before.mesh, journey.target, reach=stage.reach, start=before.refuge)
    if not left:  # thin walls, which large faces cut through: better as they were
        journey.mesh, journey.refuge, journey.record = mesh, mesh, before.record
