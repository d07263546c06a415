"""A budget of vertices spent where curvature and distance to the data ask for them."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.mesh.edited import Edited
from simplexmesh.mesh.editing import EditableMesh
from simplexmesh.mesh.least import least_vertices
from simplexmesh.mesh.regularize import regularize
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.dividing import composed, divided, removable, taken_apart
from simplexmesh.motion.face_score import face_distance, face_score
from simplexmesh.motion.refined import Ledger, Refined, Round
from simplexmesh.motion.settling import Settling, with_even_metric
from simplexmesh.motion.state import Target
from simplexmesh.motion.untangle import tangled_vertices
from simplexmesh.motion.wishes import as_target, default_reach

GROWTH = 1.25
"""The number of vertices grows by at most this factor in a round."""

SHRINKAGE = 0.88
"""And shrinks by no less."""

MOST_EXCHANGED = 0.1
"""At most this share of the faces is merged in a round for the sake of others."""

WORTHWHILE = 0.5
"""Two faces are merged when the one they leave scores less than this times a face that can be divided instead."""


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
    watch: Callable[[Round, SimplexMesh], None] | None = None,
) -> Refined:
    """Give a mesh so many vertices and spend them where its data asks for them.

    In turns with motion, the faces of the highest score are divided (T2) and the pairs of the lowest are merged (T1),
    first until the number is right, then in `rounds` more in which as many are merged as divided, while that lowers
    the highest scores. The number reached is within 1 % of that asked for, unless the start or the topology forbids.

    Parameters
    ----------
    mesh : SimplexMesh
        A mesh that has been fitted already.
    target : Target or data
        What draws the mesh, as in `refine`.
    vertices : int, optional
        How many it is to have. Default: as many as it has.
    reach : float, optional
        How far the data is looked for, in its unit. Default: 10 % of the mesh's diagonal.
    rounds : int
        How many rounds of exchange.
    iterations : int
        How many iterations the mesh moves in each round.
    adaptation, rigidity
        As in `refine`.
    level, label : optional
        Of a volume given as `target`.
    watch : callable, optional
        Called after each round with what was done and the mesh.

    Returns
    -------
    Refined
        The mesh, and where its vertices and faces went; an interrupt (Ctrl-C) returns the last whole state.

    Raises
    ------
    ValueError, TypeError
        One sentence on what is wrong, before any long work.
    TopologyError
        When the mesh is not complete.
    DivergedError
        When the motion left the finite numbers.

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
    _check.instance("mesh", mesh, SimplexMesh)
    wanted = mesh.n_vertices if vertices is None else _check.integer("vertices", vertices, 20)
    if wanted < (fewest := least_vertices(mesh.connectivity)):
        raise ValueError(f"vertices must be at least {fewest}, for genus {mesh.genus}, not {wanted}")
    rounds = _check.integer("rounds", rounds, 0)
    if watch is not None and not callable(watch):
        raise TypeError(f"watch must be a function of a Round and the mesh, not {type(watch).__name__}")
    goal, reach = as_target(target, level=level, label=label), default_reach(mesh, reach)
    settling = Settling.checked(goal, reach, iterations=iterations, adaptation=adaptation, rigidity=rigidity)
    ledger = Ledger(mesh, settling, watch=watch)
    try:
        for count in _course(mesh.n_vertices, wanted, rounds):
            ledger.enter(redistribute_round(ledger.mesh, goal, reach=reach, vertices=count))
        ledger.close()
        ledger.converged = abs(ledger.mesh.n_vertices - wanted) <= max(1, 0.01 * wanted)
    except KeyboardInterrupt:
        ledger.interrupted = True
    return ledger.result()


def _course(start: int, wanted: int, rounds: int) -> list[int]:
    """Return how many vertices to have after each round: at an even pace to the number wanted, then that."""
    pace = GROWTH if wanted > start else SHRINKAGE
    steps = math.ceil(math.log(wanted / start) / math.log(pace) - 1e-9)
    return [round(start * (wanted / start) ** (k / steps)) for k in range(1, steps + 1)] + [wanted] * rounds


def redistribute_round(
    mesh: SimplexMesh, target: Target, *, reach: float, vertices: int, tangled: NDArray[np.bool_] | None = None
) -> Refined:
    """Do one round of edits without motion: merge low faces and divide high ones, to end with so many vertices.

    Parameters
    ----------
    mesh : SimplexMesh
    target : Target
    reach : float
        How far the data is looked for.
    vertices : int
        How many to have after it, within one or what can be done at once.
    tangled : (n,) array of bool, optional
        Which vertices are tangled, when that is known: their faces are neither divided nor merged for others. To find
        out is half the cost of a round.

    Returns
    -------
    Refined
        Of one round.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.targets.Triangles(sm.sphere(20).triangulated())
    >>> redistribute_round(sm.sphere(6), ball, reach=0.5, vertices=700).mesh.n_vertices
    700
    """
    c = mesh.connectivity
    parts = face_score(mesh, face_distance(mesh, target, reach), reach)
    scores = parts.total
    scores[c.vertex_faces[tangled_vertices(mesh) if tangled is None else tangled].ravel()] = 0.0
    order = np.argsort(-scores, kind="stable")
    high = order[(scores[order] > 0) & ~c.face_is_hole[order] & (c.face_sizes[order] > 4)]
    change = (vertices - mesh.n_vertices) // 2
    darts, around, merged = removable(c, parts)
    most = max(-change, 0) + int(MOST_EXCHANGED * c.n_faces)
    sorted_ = np.argsort(merged, kind="stable")
    low = sorted_[taken_apart(around[sorted_], c.face_sizes.size, most)]
    edit = EditableMesh(mesh)
    few = darts[low[: _exchanged(merged[low], scores[high], change)]]
    removed = int(edit.remove_edges(few, in_order=True).done.sum())
    cut, _ = divided(edit, mesh, high, 2 * max(change + removed, 0), np.ones(scores.size, bool), fewest=5)
    first = edit.result()
    even = regularize(first.mesh)
    maps = composed((first.vertex_map, first.face_map), even)
    out = Edited(even.mesh, _check.frozen(maps[0]), _check.frozen(maps[1]))
    told = Round(0, float(scores.max(initial=0.0)), cut, 0, out.mesh.n_vertices, removed, even.swaps)
    return Refined(with_even_metric(out), out.vertex_map, out.face_map, (told,))


def _exchanged(merged: NDArray[np.float64], high: NDArray[np.float64], change: int) -> int:
    """Return how many pairs to merge: those that must go, and as many more as pay for the division of another face."""
    must, more = min(max(-change, 0), len(merged)), max(change, 0)
    count = min(len(merged) - must, max(len(high) - more, 0))
    pays = merged[must : must + count] < WORTHWHILE * high[more : more + count]
    return must + (count if pays.all() else int(np.argmin(pays)))
