"""A reconstruction in progress: the one object that every step changes; how it starts, settles and finishes."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Mask
from simplexmesh._base.errors import DivergedError, TopologyError, warn
from simplexmesh._base.progress import Progress
from simplexmesh._base.units import common_unit
from simplexmesh.mesh.operators.regularize import exceptional_faces, regularize
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.mesh.triangulation import fan
from simplexmesh.motion.model.deform import DeformableModel
from simplexmesh.motion.model.state import Stage, State, is_at_rest, mean_edge
from simplexmesh.motion.model.untangle import Tangles, untangled
from simplexmesh.motion.reconstruct.inputs import Input
from simplexmesh.motion.reconstruct.options import Options, stages_from
from simplexmesh.motion.reconstruct.outer_side import border_width
from simplexmesh.motion.reconstruct.result import UNMEASURED, Distance, Reconstruction, TopologyRecord, with_data_of
from simplexmesh.motion.start.primitives import ENCLOSING, primitive_around
from simplexmesh.motion.start.report import Start, StartReport
from simplexmesh.motion.targets.protocol import Target
from simplexmesh.motion.targets.triangles import surface_distance
from simplexmesh.motion.topology.handles import add_handles, given_pairs
from simplexmesh.motion.topology.holes import given_zones
from simplexmesh.numerics.kd_tree import uneven_tree
from simplexmesh.surface.features.lines.network import FeatureLine

FEWEST_WRAPPED = 60
"""Meshes of fewer vertices would collapse when they are wrapped around the data, and have no room for handles."""

MOST_POINTS = 200_000
"""Of the data, drawn at random, for distances to the mesh."""

OPEN = 0.05
"""Width of the border of data, in its diagonals, from which no closed model is looked for."""


@dataclass
class Run:
    """A reconstruction in progress; the attributes without a comment are those of `Reconstruction`."""

    options: Options
    data: Input  # with normals turned outward where the start needs that
    report: Progress
    start: SimplexMesh
    mesh: SimplexMesh  # always a complete state
    target: Target
    stages: list[Stage]  # the stiff ones, the fine one and the last
    found: StartReport | None = None
    surface: SimplexMesh | None = None  # the automatic start of closed data, around which `mesh` is wrapped
    zones: list[Mask] = field(default_factory=list)  # faces of holes that the user gave
    fallback: SimplexMesh | None = None  # untangled, of the same connectivity near the data, when one is known
    topology: TopologyRecord = field(default_factory=TopologyRecord)
    creases: tuple[FeatureLine, ...] = ()
    history: list[State] = field(default_factory=list)
    distance: Distance = UNMEASURED
    bare: float = float("nan")
    done: float = 0.0  # share of the motion, 0 to 1
    converged: bool = False
    interrupted: bool = False
    tangled: int | None = None
    restored: int = 0
    strayed: int = 0
    diverged: str = ""  # what ended a stage of the motion early
    lost: str = ""  # a message about data that the mesh strayed from
    _away: tuple[SimplexMesh, Array, Array] | None = None

    @property
    def alone(self) -> bool:
        """Whether the model is that of the largest of several bodies, made along its edges."""
        return self.data.leaves_bodies and self.found is None and self.options.init == "auto"

    @property
    def opens(self) -> bool:
        """Whether holes are opened where the data ends."""
        wanted = self.options.holes
        return wanted != "none" and (wanted != "open" or (self.found is not None and self.found.is_open))

    @property
    def refines(self) -> bool:
        """Whether faces are divided until there are as many vertices as wanted."""
        wanted = self.options.refine
        return wanted != "none" and (wanted != "open" or self.mesh.n_holes > 0)

    @cached_property
    def points(self) -> Array:
        """(m, 3) the points of the data, drawn at random if they are very many."""
        points = self.data.points
        if len(points) <= MOST_POINTS:
            return points
        return points[np.random.default_rng(0).choice(len(points), MOST_POINTS, replace=False)]

    @cached_property
    def tree(self) -> cKDTree:
        """The tree of `points`."""
        return uneven_tree(self.points)

    def away(self, points: Array) -> Array:
        """Return the distances (m,) of points from the mesh; the last are known as long as neither changes."""
        if self._away is None or self._away[0] is not self.mesh or self._away[1] is not points:
            distances = surface_distance(points, *fan(self.mesh.vertices, self.mesh.connectivity))
            self._away = self.mesh, points, distances
        return self._away[2]

    def move(self, *stages: Stage, until: float) -> None:
        """Move through stages, each until it is at rest; `until` is the share of the motion done then.

        A stage also ends, before the step, where a vertex would leave the start and the data: sparse points do not tell
        everywhere where the surface is. The mesh there is nearer to them in the mean than that before the stage.
        """
        begun, total = self.done, sum(stage.iterations for stage in stages)
        before = 0
        for stage in stages:
            self.converged = False
            edge, states = mean_edge(self.mesh), len(self.history)
            model = DeformableModel(
                self.mesh, self.target, rigidity=stage.rigidity, reach=stage.reach, alpha=stage.alpha, beta=stage.beta,
                adaptation=stage.adaptation,
            )  # fmt: skip
            try:
                for state in model.run(stage.iterations, warnings=False):
                    self.history.append(state)
                    self.progress(begun + (until - begun) * (before + state.iteration) / total)
                    self.converged = is_at_rest(self.history[states:], edge)
                    if self.converged:
                        break
            except DivergedError as error:
                self.diverged = str(error)
            finally:
                self.mesh = model.mesh
            before += stage.iterations
        self.done = until

    def progress(self, done: float) -> None:
        """Record and report the share of the motion done."""
        self.done = done
        self.report(0.1 + 0.8 * done, "fitting")

    def untangle(self, reach: float) -> int:
        """Remove folds and intersections; return the number of vertices still tangled."""
        tangles = untangled(Tangles(self.mesh), self.target, reach=reach, start=self.fallback)
        self.mesh = tangles.mesh
        if not tangles.count:
            self.fallback = self.mesh
        return tangles.count

    def count(self, **numbers: int) -> None:
        """Add to counts in the record of changes."""
        more = {name: getattr(self.topology, name) + number for name, number in numbers.items()}
        self.topology = replace(self.topology, **more)

    def result(self) -> Reconstruction:
        """Return the model as it is now."""
        exceptions = tuple(exceptional_faces(self.mesh.connectivity).tolist())
        mesh = with_data_of(self.mesh, self.data.source)
        return Reconstruction(
            mesh, self.distance, tuple(self.history), self.converged, self.start, self.found, self.tangled,
            self.interrupted, replace(self.topology, exceptions=exceptions), self.bare,
            self.restored, self.strayed, self.creases,
        )  # fmt: skip


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
    if run.refines:
        even = regularize(run.mesh)
        if even.swaps:
            run.mesh, run.fallback = even.mesh, None
            run.count(swapped=even.swaps)
    run.move(last, until=1.0)
    run.report(0.92, "untangling")
    run.tangled = run.untangle(last.reach)


def started(data: Input, options: Options, report: Progress) -> Run:
    """Return the reconstruction at its start, pairs of faces that the user gave joined to handles."""
    init, target, found = options.init, None, None
    wraps = init in ENCLOSING and not isinstance(options.handles, list) and options.handles != "none"
    if isinstance(init, SimplexMesh):
        common_unit("data and init", (data.source, init))
        mesh = init
    elif init == "auto":
        found, target = data.start(options.vertices, options.tunnels)
        data, mesh = data.without(found), found.mesh
        if options.holes == "none" and found.report.openness > 1:
            raise TopologyError("the data is an open surface that no lid closes; holes='auto' leaves it open")
    else:
        found, target = _closed_start(data, options) if wraps else (None, None)
        if found is None and init != "plane":
            data = data.turned_outward(enclosed=init in ENCLOSING)
        normals = data.samples().normals
        facing = None if normals is None else normals.mean(axis=0)
        mesh = primitive_around(data.points, init, options.first_vertices, facing=facing)
    run = Run(options, data, report, mesh, mesh, data.target if target is None else target, [])
    if found is not None:
        run.found = found.report
        run.surface, run.fallback = (None, mesh) if init == "auto" else (found.mesh, None)
    run.stages = stages_from(mesh, data, options, cell=found.report.cell if found and init == "auto" else None)
    _apply_given_faces(run)
    return run


def _apply_given_faces(run: Run) -> None:
    """Check the zones and pairs of faces that the user gave, join the pairs, and number the zones as after that."""
    zones, pairs = run.options.holes, run.options.handles
    if isinstance(zones, list):
        run.zones = [zone & ~run.mesh.connectivity.face_is_hole for zone in given_zones(run.mesh, zones, "holes")]
    if isinstance(pairs, list):
        pairs = given_pairs(run.mesh, pairs, "handles")
        if any(zone[pairs].any() for zone in run.zones):
            raise ValueError("holes and handles must not share a face of the start")
        out = add_handles(run.mesh, pairs=pairs)
        run.mesh, run.fallback, run.topology = out.mesh, None, replace(run.topology, handles=out.proposals)
        faces = np.arange(len(out.mesh.connectivity.face_sizes))
        run.zones = [np.isin(faces, out.face_map[zone]) for zone in run.zones]


def _closed_start(data: Input, options: Options) -> tuple[Start, Target] | tuple[None, None]:
    """Return the automatic start of closed data; None for other data, and a user's function is told why."""
    few = options.vertices < FEWEST_WRAPPED
    if not few and border_width(data.target, data.points) < OPEN:
        try:
            start, target = data.start(options.vertices, options.tunnels)
        except TopologyError as error:
            warn(f"no handles are looked for, as the genus of the data is not known: {error}")
            return None, None
        if not start.report.is_open:
            return start, target
    if callable(options.handles):
        reason = "the model has too few vertices" if few else "the data is open"
        warn(f"no handles are looked for, as {reason}")
    return None, None
