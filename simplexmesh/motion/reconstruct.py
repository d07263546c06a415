"""Reconstruction of a surface model from data in one call."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplexmesh import _check
from simplexmesh.errors import warn
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.distance import Distance, Summary
from simplexmesh.motion.fit import Fit
from simplexmesh.motion.initial.report import StartReport
from simplexmesh.motion.initialization import Initialization, given_start, initialized
from simplexmesh.motion.measure import measured
from simplexmesh.motion.missing_topology import open_data_message, with_missing_tunnels
from simplexmesh.motion.plan import Choice, TopologyRecord, plan_for
from simplexmesh.motion.progress import Report, reporting
from simplexmesh.motion.rim_unfold import unfolded_rims
from simplexmesh.motion.stages import stages_for
from simplexmesh.motion.state import State
from simplexmesh.motion.subjects import as_subject
from simplexmesh.motion.topology_adapt import staged_fit
from simplexmesh.motion.untangle import untangled

Array = NDArray[np.float64]

FEWEST_VERTICES, MOST_VERTICES = 20, 20_000_000
"""More vertices would take tens of gigabytes, and the process would be killed."""

ADAPTATION = 0.05
UNMEASURED = Distance(*(Summary.of(np.zeros(0)) for _ in range(3)))


@dataclass(frozen=True, repr=False)
class Reconstruction:
    """A reconstructed surface model, its quality of fit, and the record of how it was made.

    Attributes
    ----------
    mesh : SimplexMesh
        The model, in the data's physical space; its data array `distance` is that of each vertex to the data.
    distance : Distance
        Mean, rms, 95th percentile and maximum distance, from mesh to data and from data to mesh, in the data's unit.
        NaN when the run was interrupted before they were measured.
    history : list of State
        One state per iteration.
    converged : bool
        Whether the mesh came to rest within the iterations.
    start : SimplexMesh
        The start mesh.
    found : StartReport or None
        Report of the automatic start: grid, genus, tunnels sealed, pieces dropped.
    tangled : int or None
        Number of vertices on faces that are folded or intersect others after untangling: 0, unless the model is too
        coarse for the data or of another topology. `mesh.check(self_intersections=True)` lists them. None when the
        motion was interrupted before the test.
    interrupted : bool
        Whether the run was interrupted (Ctrl-C); `mesh` is then the last complete state.
    topology : TopologyRecord
        The holes and handles proposed, each accepted or refused with a reason, and the counts of refinement.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> model = sm.reconstruct(sm.sphere(16).vertices, vertices=300)
    >>> model.mesh.n_vertices, model.tangled, model.interrupted
    (300, 0, False)
    """

    mesh: SimplexMesh
    distance: Distance
    history: list[State] = field(default_factory=list)
    converged: bool = False
    start: SimplexMesh | None = None
    found: StartReport | None = None
    tangled: int | None = None
    interrupted: bool = False
    topology: TopologyRecord = field(default_factory=TopologyRecord)

    def __repr__(self) -> str:
        rest = "interrupted" if self.interrupted else "at rest" if self.converged else "still moving"
        return (
            f"Reconstruction({self.mesh!r}, mesh to data rms {self.distance.mesh_to_data.rms:.4g}, "
            f"data to mesh rms {self.distance.data_to_mesh.rms:.4g}, {rest} after {len(self.history)} iterations)"
        )


def reconstruct(
    data: Any,
    *,
    level: float | None = None,
    label: int | None = None,
    vertices: int = 4000,
    init: str | Path | SimplexMesh = "auto",
    inside: str = "above",
    components: str = "largest",
    tunnels: float | None = None,
    poses: Any = None,
    iterations: int = 500,
    rigidity: int = 1,
    adaptation: float | None = None,
    placement: str | None = None,
    holes: Choice | None = None,
    handles: Choice | None = None,
    refine: str | None = None,
    progress: bool | Report = False,
) -> Reconstruction:
    """Fit a simplex mesh to a volume, a point cloud, scans or a triangulated surface.

    Parameters
    ----------
    data : Volume, PointCloud, TriangleMesh, array, pyvista or trimesh object, path, or sequence of scans
        An (n, 3) array is a point cloud, a 3-D array a volume of spacing 1.
    level : float, optional
        For a volume of intensities: the isovalue of the surface.
    label : int, optional
        For a label volume: the region. Optional when there is only one.
    vertices : int
        Number of vertices of the model; reached within 10 %. Primitives of fewer than 200 vertices come as close as
        their regular patterns allow.
    init : str, path or SimplexMesh
        ``"auto"`` finds a start of the right topology near the data; ``"sphere"``, ``"ellipsoid"``, ``"cylinder"``,
        ``"plane"`` and ``"torus"`` are placed around it; a mesh or a file of one is used as it is and keeps its
        topology (`vertices` is then ignored).
    inside : {"above", "below"}
        Whether the object of a volume is above or below `level`.
    components : {"largest", "all"}
        Whether to keep the largest component or all; "all" needs ``init="auto"``.
    tunnels : float, optional
        Width, in the data's unit, below which the automatic start seals tunnels through the body; 0 keeps them all.
        Default: what the mesh cannot resolve and, for a level of a volume, 13 voxels; points keep theirs.
    poses : path, mapping or sequence, optional
        For several scans: T_world_scan of each, by file name or in order.
    iterations : int
        Maximum number of iterations of the fine stage.
    rigidity : int
        Radius, in edges, over which curvature is averaged in the fine stage: 1 follows the data closely, 6 is stiff.
    adaptation : float
        Strength, 0 to 0.25, with which vertices move to where the surface bends. Default: 0.05, or 0 for an even
        placement.
    placement : {"adaptive", "even"}
        Whether vertices are redistributed by curvature and distance to the data, as by `redistribute`: faces of high
        score are divided, those of low score merged. Default: "adaptive", but "even" when `adaptation` is 0, for a
        mesh given as start, for models with holes (`refine` places their vertices) and for bodies of a volume thinner
        than 4.5 edges on average.
    holes : {"auto", "none"}, callable or sequence of arrays of int
        Whether holes are opened where the data ends: "auto" (the default for primitives), "none", those that a
        function of a `HoleProposal` accepts, or the zones given, by the faces of the start.
    handles : {"auto", "none"}, callable or sequence of pairs of int
        The same for handles, given by the pairs of faces to join.
    refine : {"none", "auto", "coarse", "medium", "fine"}
        Refinement of faces that bend or are far from the data: "auto" (the default for primitives) begins with fewer
        vertices and uses all of `vertices`, the others stop at their threshold or at `vertices`.
    progress : bool or callable
        True shows a bar; a function is called with the fraction done and a message.

    Returns
    -------
    Reconstruction
        The model; after an interrupt (Ctrl-C), its last complete state.

    Raises
    ------
    ValueError, TypeError, OSError, TopologyError
        For invalid data or arguments, before any long computation.
    DivergedError
        When the motion diverges; with the last valid mesh.

    Warns
    -----
    SimplexMeshWarning
        For data that was repaired, and for a model that misses much of the data, is far from data in a large part, or
        remains tangled.

    References
    ----------
    H. Delingette, *General object reconstruction based on simplex meshes*, IJCV 32(2), 1999, 111-146,
    doi 10.1023/A:1008157432188; thesis, 1994, sections 5.1 to 5.5.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> x, y, z = np.mgrid[-10:11, -10:11, -10:11].astype(float)
    >>> ball = sm.Volume(8.3 - np.sqrt(x * x + y * y + z * z), origin=(-10, -10, -10))
    >>> model = sm.reconstruct(ball, level=0.0, vertices=500)
    >>> model.mesh.genus, model.distance.mesh_to_data.rms < 0.05
    (0, True)
    """
    vertices = _check.integer("vertices", vertices, FEWEST_VERTICES, MOST_VERTICES)
    iterations = _check.integer("iterations", iterations, 0)
    rigidity = _check.integer("rigidity", rigidity, 0)
    _check.choice("components", components, ("largest", "all"))
    _check.choice("inside", inside, ("above", "below"))
    tunnels = None if tunnels is None else _check.number("tunnels", tunnels, 0.0)
    given = given_start(init)
    if adaptation is None:
        adaptation = 0.0 if placement == "even" else ADAPTATION
    adaptation = _check.number("adaptation", adaptation, 0.0, 0.25)
    placement = "even" if placement is None and not adaptation else placement
    plan = plan_for(given if isinstance(given, str) else None, vertices, holes, handles, refine, placement)
    if components == "all" and given != "auto":
        raise ValueError("components='all' needs init='auto'; a given start keeps its components")
    with reporting(progress) as report:
        report(0.0, "reading")
        subject = as_subject(data, level=level, label=label, inside=inside, components=components, poses=poses)
        report(0.05, "finding a start")
        initial = initialized(subject, given, plan, vertices=vertices, tunnels=tunnels, placement=placement)
        cell = initial.found.cell if initial.found else None
        stages = stages_for(initial.mesh, initial.subject, iterations, rigidity, adaptation, cell=cell)
        fit = staged_fit(
            initial.mesh, initial.target, stages, initial.plan, samples=initial.samples,
            watch=lambda share: report(0.1 + 0.8 * share, "fitting"),
        )  # fmt: skip
        model = _finished(initial, fit, stages[-1].reach, report, whole=components == "all")
    model, messages = _with_warnings(model, initial)
    for message in messages:
        warn(message)
    return model


def _finished(initial: Initialization, fit: Fit, reach: float, report: Report, *, whole: bool) -> Reconstruction:
    """Return the model of a fit, untangled and measured unless interrupted."""
    model = Reconstruction(
        fit.mesh, UNMEASURED, fit.history, fit.converged, initial.mesh, initial.found,
        interrupted=fit.interrupted, topology=fit.record,
    )  # fmt: skip
    try:
        if not model.interrupted:
            report(0.92, "untangling")
            fallback = fit.fallback if initial.found else None
            mesh, tangled = untangled(model.mesh, fit.target, reach=reach, start=fallback)
            model = replace(model, mesh=unfolded_rims(mesh), tangled=tangled)
    except KeyboardInterrupt:
        model = replace(model, interrupted=True)
    try:
        report(0.95, "measuring")
        dropped = not whole and initial.found is not None and initial.found.components_dropped > 0
        distance, away = measured(model.mesh, initial.subject, reach, dropped=dropped)
        model = replace(model, mesh=model.mesh.with_data(distance=away), distance=distance)
        report(1.0, "done")
    except KeyboardInterrupt:
        model = replace(model, interrupted=True)
    return model


def _with_warnings(model: Reconstruction, initial: Initialization) -> tuple[Reconstruction, list[str]]:
    """Return the model, missing handles added to its record, and the messages of warnings about it."""
    messages = []
    if not model.interrupted:
        if initial.plan.holes == "auto":
            messages.append(open_data_message(initial.subject, model.mesh))
        if initial.samples is not None:
            handles, lack = with_missing_tunnels(initial.samples, model.topology.handles, model.mesh)
            model = replace(model, topology=replace(model.topology, handles=handles))
            messages.append(lack)
    if model.tangled:
        messages.append(
            f"{model.tangled} vertices are on faces that are folded or cross others; more vertices or another start "
            "may help"
        )
    return model, [message for message in messages if message]
