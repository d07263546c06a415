"""A mesh that finds its topology on the way: coarse motion, holes and handles, fine motion with refinement."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simplexmesh import _check
from simplexmesh.mesh.regularize import regularize
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.evolve import Course, Stage, evolved, mean_edge
from simplexmesh.motion.handles import HandleProposal, add_handles
from simplexmesh.motion.holes import HoleProposal, open_holes
from simplexmesh.motion.refine import THRESHOLDS, refine_round
from simplexmesh.motion.rim_refine import divided_rims
from simplexmesh.motion.settling import with_even_metric
from simplexmesh.motion.state import State, Target
from simplexmesh.motion.tunnels import tunneled
from simplexmesh.motion.wrap import Samples

Array = NDArray[np.float64]

FAR_FROM_BORDER = 6.0
"""In mean edges: a hole is opened by itself only where the data ends no farther away."""

FEWEST_FOR_TUNNELS = 1200
"""Coarser meshes do not find their way through the holes of objects."""

FIRST = 0.42
"""The share of the vertices that a start has when refinement spends the others: 720 of 1,700, as in the thesis."""

ENOUGH = 720
"""A start of fewer is too coarse to find holes; it gets up to eight tenths of the vertices."""

TURN, MOST_TURNS = 21, 16
NO_LIMIT = 1e-12

Choice = str | Sequence[Any] | Callable[[Any], bool]


@dataclass(frozen=True)
class Plan:
    """What may change on the way.

    Attributes
    ----------
    holes, handles : {"auto", "none"}, function or sequence
        Which proposals are accepted; a sequence gives the zones, or the pairs of faces.
    refine : {"none", "auto", "coarse", "medium", "fine"}
        How fine faces become; "auto" uses all vertices up to `vertices`.
    vertices : int
        The most there may be.
    """

    holes: Choice = "none"
    handles: Choice = "none"
    refine: str = "none"
    vertices: int = 0

    @property
    def first_vertices(self) -> int:
        """How many the start should have: refinement adds the others."""
        return self.vertices if self.refine == "none" else max(int(FIRST * self.vertices), min(int(0.8 * self.vertices), ENOUGH))

    @property
    def changes(self) -> bool:
        """Whether anything may."""
        return not (self.holes == "none" and self.handles == "none" and self.refine == "none")


@dataclass(frozen=True)
class TopologyRecord:
    """What was changed of a mesh's topology while it moved.

    Attributes
    ----------
    holes : tuple of HoleProposal
        The zones far from the data, each cut off or with the reason why not.
    handles : tuple
        The pairs of faces considered for a handle, likewise.
    refined : int
        Vertices that refinement added.
    swapped : int
        Edges swapped to even out the sizes of faces.
    """

    holes: tuple[HoleProposal, ...] = ()
    handles: tuple[HandleProposal, ...] = ()
    refined: int = 0
    swapped: int = 0


@dataclass
class Journey:
    """A mesh on its way, and what happened to it so far."""

    mesh: SimplexMesh
    target: Target
    watch: Callable[[float], None] | None = None
    history: list[State] = field(default_factory=list)
    record: TopologyRecord = TopologyRecord()
    converged: bool = False

    def move(self, *stages: Stage, share: tuple[float, float] = (0.0, 1.0)) -> None:
        """Move through stages, which are `share` of the whole way.

        Raises
        ------
        KeyboardInterrupt
            When interrupted; the mesh is its last whole state.
        """
        low, high = share
        watch = self.watch or (lambda part: None)
        course = evolved(self.mesh, self.target, stages, watch=lambda part: watch(low + part * (high - low)))
        self.mesh, self.converged = course.mesh, course.converged
        self.history += course.history
        if course.interrupted:
            raise KeyboardInterrupt

    def noted(self, **changes: Any) -> None:
        """Write down what was done."""
        self.record = replace(self.record, **changes)


def plan_for(init: str | None, vertices: int, holes: Choice | None, handles: Choice | None, refine: str | None) -> Plan:
    """Return what may change, checked: everything for starts that are primitives, nothing for others, by default.

    Raises
    ------
    ValueError, TypeError
        For a word that is none of those known, or anything but words, functions and sequences.

    Examples
    --------
    >>> plan_for("sphere", 1000, None, None, None).refine, plan_for("auto", 1000, None, None, None).changes
    ('auto', False)
    """
    usual = "none" if init in (None, "auto") else "auto"
    for name, given in (("holes", holes), ("handles", handles)):
        if isinstance(given, str):
            _check.choice(name, given, ("auto", "none"))
        elif given is not None and not callable(given) and not hasattr(given, "__len__"):
            raise TypeError(f"{name} must be a word, a function or a sequence, not {type(given).__name__}")
    if refine is not None:
        _check.choice("refine", refine, ("none", "auto", *THRESHOLDS))
    return Plan(
        usual if holes is None else holes, usual if handles is None else handles, refine or usual, vertices
    )  # fmt: skip


def travelled(
    start: SimplexMesh,
    target: Target,
    stages: Sequence[Stage],
    plan: Plan,
    *,
    samples: Samples | None = None,
    watch: Callable[[float], None] | None = None,
) -> tuple[Course, TopologyRecord]:
    """Move a mesh through stages and let its topology change between them.

    Stiff stages; holes, then handles; the last but one stage, in turns with refinement; even face sizes; the last
    stage (Delingette 1994, figure 5.6).

    Parameters
    ----------
    start : SimplexMesh
    target : Target
    stages : sequence of Stage
        At least two.
    plan : Plan
        Without changes the mesh keeps its topology.
    samples : Samples, optional
        The data, when it is closed and the start encloses it: the mesh then finds its handles.
    watch : callable, optional
        Called with the share done.

    Returns
    -------
    Course, TopologyRecord
    """
    journey = Journey(start, target, watch)
    *coarse, fine, last = stages
    interrupted = False
    try:
        if not plan.changes:
            journey.move(*stages)
        else:
            _given_handles(journey, plan)
            wrapped = plan.handles == "auto" or callable(plan.handles)
            if samples is not None and wrapped and isinstance(plan.holes, str):
                fine = _tunnels(journey, plan, samples, fine)
            else:
                journey.move(*coarse, share=(0.0, 0.25))
                _holes(journey, plan, replace(coarse[-1], iterations=60))
            _refine(journey, plan, fine)
            journey.move(fine, share=(0.7, 0.9))
            _even(journey, plan)
            journey.move(last, share=(0.9, 1.0))
    except KeyboardInterrupt:
        interrupted = True
    return Course(journey.mesh, journey.history, journey.converged, interrupted), journey.record


def _holes(journey: Journey, plan: Plan, settle: Stage) -> None:
    """Open holes where the data ends, let the rims find its border, and again where they overhang."""
    if plan.holes == "none":
        return
    for attempt in range(3):
        mesh = journey.mesh
        choice: dict[str, Any] = {"fewest": max(3, mesh.n_faces // 100)}
        if plan.holes == "auto":
            choice["accept"] = _at_border(journey.target, mean_edge(mesh))
        elif callable(plan.holes):
            choice["accept"] = plan.holes
        elif attempt:
            return
        else:
            choice["zones"] = plan.holes
        out = open_holes(mesh, journey.target, **choice)
        before = [proposal for proposal in journey.record.holes if proposal.accepted]
        journey.noted(holes=(*before, *out.proposals))
        if out.mesh is mesh:
            return
        journey.mesh = out.mesh
        journey.move(settle, share=(0.25 + 0.05 * attempt, 0.3 + 0.05 * attempt))


def _at_border(target: Target, edge: float) -> Callable[[HoleProposal], bool]:
    """Return what accepts zones beside a border of the data: elsewhere the mesh has only not arrived yet."""
    border = getattr(target, "border", None)
    points = np.zeros((0, 3)) if border is None else border.wider(3 * edge)
    tree = cKDTree(points) if len(points) else None

    def accept(proposal: HoleProposal) -> bool:
        line = proposal.contour
        if tree is None or line is None:
            return False
        return bool(np.median(tree.query(line.mesh.vertices[line.vertices])[0]) < FAR_FROM_BORDER * edge)

    return accept


def _given_handles(journey: Journey, plan: Plan) -> None:
    """Join the pairs of faces of the start that the user gave."""
    if isinstance(plan.handles, str) or callable(plan.handles):
        return
    pairs: Any = plan.handles
    out = add_handles(journey.mesh, pairs=pairs)
    journey.mesh = out.mesh
    journey.noted(handles=out.proposals)


def _tunnels(journey: Journey, plan: Plan, samples: Samples, fine: Stage) -> Stage:
    """Wrap the mesh around the data and add the handles it has; return the fine stage for a mesh that near."""

    def watch(mesh: SimplexMesh, _: int) -> None:
        journey.mesh = mesh

    room = plan.vertices if plan.refine == "none" else int(0.85 * plan.vertices)
    out = tunneled(
        journey.mesh,
        samples,
        vertices=min(max(plan.first_vertices, FEWEST_FOR_TUNNELS), room),
        accept=plan.handles if callable(plan.handles) else None,
        watch=watch,
    )
    journey.mesh = out.mesh
    journey.noted(handles=out.proposals)
    if hasattr(journey.target, "oriented_by") and not samples.oriented:  # the mesh knows now which way is out
        nearest = cKDTree(out.mesh.vertices)
        journey.target = journey.target.oriented_by(lambda points: out.mesh.normals[nearest.query(points)[1]])
    near = min(fine.reach, 4 * mean_edge(out.mesh))
    journey.move(Stage(rigidity=3, reach=near, iterations=40), share=(0.25, 0.4))
    return replace(fine, reach=near)


def _refine(journey: Journey, plan: Plan, stage: Stage) -> None:
    """Move and divide faces by turns, a quarter more vertices each time, as far as the plan goes."""
    if plan.refine == "none":
        return
    limit = THRESHOLDS.get(plan.refine, NO_LIMIT)
    turn = replace(stage, iterations=TURN)
    before = journey.mesh.n_vertices
    for k in range(MOST_TURNS):
        journey.move(turn, share=(0.4 + 0.3 * k / MOST_TURNS, 0.4 + 0.3 * (k + 1) / MOST_TURNS))
        n = journey.mesh.n_vertices
        budget = min(plan.vertices - n, n // 4)
        if budget < 4:
            break
        journey.mesh = with_even_metric(divided_rims(journey.mesh, budget // 6))
        budget -= journey.mesh.n_vertices - n
        step = refine_round(journey.mesh, journey.target, reach=stage.reach, threshold=limit, budget=budget)
        journey.mesh = step.mesh
        if journey.mesh.n_vertices == n:
            break
    journey.noted(refined=journey.mesh.n_vertices - before)


def _even(journey: Journey, plan: Plan) -> None:
    """Swap edges until faces have five, six or seven vertices, where refinement left others."""
    if plan.refine != "none":
        even = regularize(journey.mesh)
        journey.mesh = even.mesh
        journey.noted(swapped=even.swaps)
