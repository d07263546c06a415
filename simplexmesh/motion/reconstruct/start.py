"""The first step of a reconstruction: the start mesh, the oriented data, and the schedule of the motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simplexmesh._base.errors import TopologyError, warn
from simplexmesh._base.progress import Report
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.model.stages import Stage, mean_edge
from simplexmesh.motion.model.state import Target
from simplexmesh.motion.reconstruct.inputs import Input
from simplexmesh.motion.reconstruct.open_data import border_width
from simplexmesh.motion.reconstruct.options import Options
from simplexmesh.motion.reconstruct.run import Run
from simplexmesh.motion.start.primitives import ENCLOSING, primitive_around
from simplexmesh.motion.start.report import Start
from simplexmesh.motion.topology.handles import add_handles, given_pairs
from simplexmesh.motion.topology.holes import given_zones

FEWEST_WRAPPED = 60
"""Meshes of fewer vertices would collapse when they are wrapped around the data, and have no room for handles."""

OPEN = 0.05
"""Width of the border of data, in its diagonals, from which no closed model is looked for."""


def started(data: Input, options: Options, report: Report) -> Run:
    """Return the reconstruction at its start, pairs of faces that the user gave joined to handles."""
    init, target, found = options.init, None, None
    wraps = init in ENCLOSING and not isinstance(options.handles, list) and options.handles != "none"
    if isinstance(init, SimplexMesh):
        mesh = init
    elif init == "auto":
        found, target = data.start(options.vertices, options.tunnels)
        data, mesh = data.without(found), found.mesh
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
    if few or border_width(data.target, data.points) >= OPEN:
        if callable(options.handles):
            reason = "the model has too few vertices" if few else "the data is open"
            warn(f"no handles are looked for, as {reason}")
        return None, None
    try:
        return data.start(options.vertices, options.tunnels)
    except TopologyError as error:
        warn(f"no handles are looked for, as the genus of the data is not known: {error}")
        return None, None


def stages_from(start: SimplexMesh, data: Input, options: Options, *, cell: float | None) -> list[Stage]:
    """Return three stages from an automatic start, found on a grid of cells of this size, and five from farther away.

    Rigidity and reach decrease from the stiff stages over the fine one, where metric parameters adapt, to the last.
    """
    radius = 0.5 * float(np.linalg.norm(np.ptp(data.points, axis=0)))
    edge, rigidity, iterations = mean_edge(start), options.rigidity, options.iterations
    last = max(2 * data.resolution, edge)
    if cell is not None:
        error = max(data.resolution, cell, min(1.2 * edge, 1.5 * data.resolution))  # few vertices are farther off
        near = 1.25 * error if data.layered else max(3 * data.resolution, 2 * edge)
        reach = min(near, 0.2 * radius)
        return [
            Stage(max(2, rigidity), reach, 40, beta=0.2),
            Stage(rigidity, reach, iterations, beta=0.4, adaptation=options.adaptation or 0.0),
            Stage(rigidity, min(last, reach), iterations // 2, beta=0.4),
        ]
    return [
        Stage(max(20, rigidity), 2.0 * radius, 150, alpha=0.5, beta=0.03),
        Stage(max(10, rigidity), 0.8 * radius, 60, alpha=0.5, beta=0.05),
        Stage(max(6, rigidity), 0.4 * radius, 100, beta=0.1),
        Stage(rigidity, 0.16 * radius, iterations, beta=0.3, adaptation=options.adaptation or 0.0),
        Stage(rigidity, last, iterations // 2, beta=0.4),
    ]
