"""From data to a surface model in one call."""

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
from simplexmesh.motion.initial.report import StartReport
from simplexmesh.motion.journey import Journey
from simplexmesh.motion.left_out import noted, unopened
from simplexmesh.motion.measure import measured
from simplexmesh.motion.outset import Outset, given_start, outset
from simplexmesh.motion.plan import Choice, TopologyRecord, plan_for
from simplexmesh.motion.progress import Report, reporting
from simplexmesh.motion.rim_upright import uprighted
from simplexmesh.motion.stages import stages_for
from simplexmesh.motion.state import State
from simplexmesh.motion.subjects import as_subject
from simplexmesh.motion.topology_adapt import travelled
from simplexmesh.motion.untangle import untangled

Array = NDArray[np.float64]

FEWEST_VERTICES, MOST_VERTICES = 20, 20_000_000
"""More would take tens of gigabytes on the way, and end as the system ends what asks for them."""
ADAPTATION = 0.05
UNMEASURED = Distance(*(Summary.of(np.zeros(0)) for _ in range(3)))


@dataclass(frozen=True, repr=False)
class Reconstruction:
    """A surface model and how well it fits.

    Attributes
    ----------
    mesh : SimplexMesh
        The model, in the data's physical space; its array `distance` holds how far each vertex is from the data.
    distance : Distance
        Mean, rms, 95th percentile and largest distance, from the mesh to the data and back, in the data's unit. NaN
        when the run was interrupted before they were measured.
    history : list of State
        One state per iteration.
    converged : bool
        Whether the mesh came to rest before the iterations ran out.
    start : SimplexMesh
        The mesh the motion began with.
    found : StartReport or None
        What the automatic start found and decided: grid, genus, tunnels sealed, pieces dropped.
    tangled : int or None
        Number of vertices left on faces that are folded or cross another, after all attempts to smooth them: 0, unless
        the model is too coarse for the data or of another topology. `mesh.check(self_intersections=True)` names them.
        None when the motion was interrupted before they were looked for.
    interrupted : bool
        Whether the motion was interrupted (Ctrl-C); `mesh` is then its last whole state.
    topology : TopologyRecord
        The holes and handles proposed on the way, each accepted or refused for a reason, and what was refined.

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
        For a volume of intensities: the value on the surface wanted.
    label : int, optional
        For a volume of labels: the region wanted. Not needed when there is one region only.
    vertices : int
        How many the model may have; kept within 10 %. Primitives of fewer than 200 come as near as their regular
        patterns allow.
    init : str, path or SimplexMesh
        ``"auto"`` finds a start of the right topology near the data; ``"sphere"``, ``"ellipsoid"``, ``"cylinder"``,
        ``"plane"`` and ``"torus"`` are laid around it; a mesh or a file of one starts from there and keeps its topology
        (`vertices` is then not used).
    inside : {"above", "below"}
        Whether the object is where a volume is above `level` or below.
    components : {"largest", "all"}
        Keep the largest piece or all of them; "all" needs ``init="auto"``.
    tunnels : float, optional
        The automatic start seals holes through the body that are narrower than this, in the data's unit; 0 keeps them
        all. Default: what the mesh could not resolve and, for a level of a volume, 13 voxels; points keep theirs.
    poses : path, mapping or sequence, optional
        For several scans: T_world_scan of each, by file name or in order.
    iterations : int
        Most iterations of the last, fine stage.
    rigidity : int
        How many edges far curvature is averaged in the fine stage: 1 follows the data closely, 6 is stiff.
    adaptation : float
        How strongly vertices slide to where the surface bends, 0 to 0.25. Default: 0.05, or 0 for an even placement.
    placement : {"adaptive", "even"}
        Whether the vertices are spent where curvature and distance to the data ask for them, as by `redistribute`: the
        faces that need it most are divided, those that need it least are merged. Default: "adaptive", but "even" when
        `adaptation` is 0, for a mesh given as start, for models with holes (`refine` spends their vertices) and for
        bodies of a volume thinner than 4.5 edges on average.
    holes : {"auto", "none"}, callable or sequence of arrays of int
        Whether holes are opened where the data ends: "auto" (the default for starts named but "auto"), none, those a
        function of a `HoleProposal` accepts, or the zones given, by the faces of the start.
    handles : {"auto", "none"}, callable or sequence of pairs of int
        The same for handles, by pairs of faces that are joined.
    refine : {"none", "auto", "coarse", "medium", "fine"}
        How fine the faces become that bend or are far from the data: "auto" (the default for starts named but "auto")
        begins with fewer vertices and uses all of `vertices`, the others stop at their fineness or at `vertices`.
    progress : bool or callable
        True shows a bar; a function is called with the share done and a message.

    Returns
    -------
    Reconstruction
        Truth about the fit in `distance`; an interrupt (Ctrl-C) returns the last whole state.

    Raises
    ------
    ValueError, TypeError, OSError, TopologyError
        One sentence on what is wrong, before any long work.
    DivergedError
        When the motion left the finite numbers, with the last good mesh.

    Warns
    -----
    SimplexMeshWarning
        Data that was repaired; a model that leaves out much of the data, is far from any in much of itself, or is left
        tangled.

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
        raise ValueError("components='all' needs init='auto'; a start given by you keeps its own components")
    with reporting(progress) as report:
        report(0.0, "reading")
        subject = as_subject(data, level=level, label=label, inside=inside, components=components, poses=poses)
        report(0.05, "finding a start")
        begun = outset(subject, given, plan, vertices=vertices, tunnels=tunnels, placement=placement)
        cell = begun.found.cell if begun.found else None
        stages = stages_for(begun.mesh, begun.subject, iterations, rigidity, adaptation, cell=cell)
        journey = travelled(
            begun.mesh, begun.target, stages, begun.plan, samples=begun.samples,
            watch=lambda share: report(0.1 + 0.8 * share, "fitting"),
        )  # fmt: skip
        model = _concluded(begun, journey, stages[-1].reach, report, whole=components == "all")
    model, said = _told(model, begun)
    for sentence in said:
        warn(sentence)
    return model


def _concluded(begun: Outset, journey: Journey, reach: float, report: Report, *, whole: bool) -> Reconstruction:
    """Return the model at the end of a journey, untangled and measured, or as far as it came when interrupted."""
    model = Reconstruction(
        journey.mesh, UNMEASURED, journey.history, journey.converged, begun.mesh, begun.found,
        interrupted=journey.interrupted, topology=journey.record,
    )  # fmt: skip
    try:
        if not model.interrupted:
            report(0.92, "untangling")
            refuge = journey.refuge if begun.found else None
            mesh, tangled = untangled(model.mesh, journey.target, reach=reach, start=refuge)
            model = replace(model, mesh=uprighted(mesh), tangled=tangled)
    except KeyboardInterrupt:
        model = replace(model, interrupted=True)
    try:
        report(0.95, "measuring")
        dropped = not whole and begun.found is not None and begun.found.components_dropped > 0
        distance, away = measured(model.mesh, begun.subject, reach, dropped=dropped)
        model = replace(model, mesh=model.mesh.with_data(distance=away), distance=distance)
        report(1.0, "done")
    except KeyboardInterrupt:
        model = replace(model, interrupted=True)
    return model


def _told(model: Reconstruction, begun: Outset) -> tuple[Reconstruction, list[str]]:
    """Return a model with the handles it lacks in its record, and what is to be warned of."""
    said = []
    if not model.interrupted:
        if begun.plan.holes == "auto":
            said.append(unopened(begun.subject, model.mesh))
        if begun.samples is not None:
            handles, lack = noted(begun.samples, model.topology.handles, model.mesh)
            model = replace(model, topology=replace(model.topology, handles=handles))
            said.append(lack)
    if model.tangled:
        said.append(
            f"{model.tangled} vertices are on faces that are folded or cross others; more vertices or another start "
            "may help"
        )
    return model, [sentence for sentence in said if sentence]
