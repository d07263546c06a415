"""Redistribution of a fixed number of vertices by curvature and distance to the data."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Mask
from simplexmesh.mesh.check import tangled_vertices
from simplexmesh.mesh.decimation.vertex_bound import minimum_vertices
from simplexmesh.mesh.operators.editable_mesh import EditableMesh
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.density.face_edits import (
    disjoint_groups,
    divide_faces,
    face_distance,
    face_score,
    removable_edges,
    unresolved_faces,
    with_even_metric,
)
from simplexmesh.motion.density.refinement import Refined, Refinement, Round, as_target, default_reach
from simplexmesh.motion.targets.protocol import Target

GROWTH = 1.25
"""Largest ratio of the numbers of vertices after and before a round."""

SHRINKAGE = 0.88
"""Smallest such ratio."""

MOST_EXCHANGED = 0.1
"""Largest fraction of the faces merged in a round in exchange for divisions."""

WORTHWHILE = 0.5
"""Two faces are merged when the score of the merged face is below this times that of the face divided instead."""


def redistribute(
    mesh: SimplexMesh,
    target: Any,
    *,
    vertices: int | None = None,
    reach: float | None = None,
    rounds: int = 5,
    iterations: int = 25,
    adaptation: float = 0.05,
    rigidity: int = 1,
    level: float | None = None,
    label: int | None = None,
    inside: str = "above",
    watch: Callable[[Round, SimplexMesh], None] | None = None,
) -> Refined:
    """Change a mesh to a given number of vertices, placed according to curvature and distance to the data.

    Alternating with motion, faces of high score are divided (T2) and pairs of low score merged (T1), first until the
    number is reached, then in `rounds` more rounds with as many merged as divided, while that lowers the highest
    scores. The number reached is within 1 % of that requested, unless the start or the topology prevents it.

    Parameters
    ----------
    mesh : SimplexMesh
        A fitted mesh.
    target : Target or data
        What attracts the mesh, as in `refine`.
    vertices : int, optional
        Number wanted. Default: the present one.
    rounds : int
        Number of rounds of exchange.
    iterations : int
        Iterations of motion in each round.
    reach, adaptation, rigidity, level, label, inside, watch
        As in `refine`.

    Returns
    -------
    Refined
        The mesh, with vertex and face maps; an interrupt (Ctrl-C) returns the last complete state.

    Raises
    ------
    ValueError, TypeError
        For invalid arguments, before any long computation.
    TopologyError
        When the mesh is not complete.
    DivergedError
        When the motion diverges.

    References
    ----------
    The score: H. Delingette, thesis, 1994, section 5.5.2.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> egg = sm.ellipsoid((1.0, 1.0, 3.0), 16).triangulated()
    >>> even = sm.reconstruct(egg, vertices=300, adaptation=0.0).mesh
    >>> out = sm.redistribute(even, egg)
    >>> abs(out.mesh.n_vertices - 300) <= 3, out.mesh.genus
    (True, 0)
    """
    checks.instance("mesh", mesh, SimplexMesh)
    wanted = mesh.n_vertices if vertices is None else checks.integer("vertices", vertices, 20)
    if wanted < (fewest := minimum_vertices(mesh.connectivity)):
        raise ValueError(f"vertices must be at least {fewest}, for genus {mesh.genus}, not {wanted}")
    rounds = checks.integer("rounds", rounds, 0)
    goal, reach = as_target(target, level=level, label=label, inside=inside), default_reach(mesh, reach)
    refinement = Refinement(mesh, goal, reach, iterations, adaptation, rigidity, watch=watch)
    with refinement.interruptible():
        for count in _vertex_schedule(mesh.n_vertices, wanted, rounds):
            refinement.apply(redistribute_round(refinement.mesh, goal, reach=reach, vertices=count))
        refinement.finish()
        refinement.converged = abs(refinement.mesh.n_vertices - wanted) <= max(1, 0.01 * wanted)
    return refinement.result()


def _vertex_schedule(start: int, wanted: int, rounds: int) -> list[int]:
    """Return the number of vertices after each round: a geometric sequence to `wanted`, then `rounds` times that."""
    factor = GROWTH if wanted > start else SHRINKAGE
    steps = math.ceil(math.log(wanted / start) / math.log(factor) - 1e-9)
    return [round(start * (wanted / start) ** (k / steps)) for k in range(1, steps + 1)] + [wanted] * rounds


def redistribute_round(
    mesh: SimplexMesh, target: Target, *, reach: float, vertices: int, tangled: Mask | None = None
) -> Refined:
    """Merge low-scoring faces and divide high-scoring ones, none tangled, to `vertices` in all; without motion."""
    c = mesh.connectivity
    away, differ = face_distance(mesh, target, reach)
    factors = face_score(mesh, away, reach)
    scores = np.where(unresolved_faces(mesh, target, differ), 0.0, factors.total)
    scores[c.vertex_faces[tangled_vertices(mesh) if tangled is None else tangled].ravel()] = 0.0
    order = np.argsort(-scores, kind="stable")
    highest = order[(scores[order] > 0) & ~c.face_is_hole[order] & (c.face_sizes[order] > 4)]
    change = (vertices - mesh.n_vertices) // 2
    darts, around, merged = removable_edges(c, factors)
    most = max(-change, 0) + int(MOST_EXCHANGED * c.n_faces)
    ascending = np.argsort(merged, kind="stable")
    lowest = ascending[disjoint_groups(around[ascending], c.face_sizes.size, most)]
    edit = EditableMesh(mesh)
    removed_darts = darts[lowest[: _merge_count(merged[lowest], scores[highest], change)]]
    removed = int(edit.remove_edges(removed_darts, in_order=True).done.sum())
    cut = divide_faces(edit, mesh, highest, 2 * max(change + removed, 0), np.ones(scores.size, bool))
    swaps, out = edit.even_out(), edit.result()
    done = Round(0, float(scores.max(initial=0.0)), cut, out.mesh.n_vertices, removed, swaps)
    return Refined(with_even_metric(out), out.vertex_map, out.face_map, (done,))


def _merge_count(merged: Array, highest: Array, change: int) -> int:
    """Return the number of pairs to merge: those that must go, and those worth exchanging for a division."""
    must, more = min(max(-change, 0), len(merged)), max(change, 0)
    count = min(len(merged) - must, max(len(highest) - more, 0))
    worthwhile = merged[must : must + count] < WORTHWHILE * highest[more : more + count]
    return must + (count if worthwhile.all() else int(np.argmin(worthwhile)))
