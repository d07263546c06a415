"""The first step of a reconstruction: the start mesh, the oriented data, and the schedule of the motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simplexmesh._base.errors import TopologyError, warn
from simplexmesh._base.progress import Report
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.model.stages import Stage, mean_edge
from simplexmesh.motion.reconstruct.inputs import Input, Start
from simplexmesh.motion.reconstruct.options import Options
from simplexmesh.motion.reconstruct.run import Run
from simplexmesh.motion.start.primitives import ENCLOSING, primitive_around
from simplexmesh.motion.topology.handles import add_handles
from simplexmesh.motion.topology.missing import border_width

FEWEST_WRAPPED = 60
"""Meshes of fewer vertices would collapse when they are wrapped around the data, and have no room for handles."""

OPEN = 0.05
"""Width of the border of data, in its diagonals, from which no closed model is looked for."""


def started(data: Input, options: Options, report: Report) -> Run:
    """Return the reconstruction at its start, pairs of faces that the user gave joined to handles."""
    init, target, found, surface = options.init, None, None, None
    if isinstance(init, SimplexMesh):
        mesh = init
    elif init == "auto":
        mesh, target, found = data.start(options.vertices, options.tunnels)
    else:
        closed = _closed_start(data, options) if _wraps(options) else None
        if closed is not None:
            surface, target, found = closed
        elif init != "plane":
            data = data.turned_outward(enclosed=init in ENCLOSING)
        normals = data.samples().normals
        facing = None if normals is None else normals.mean(axis=0)
        mesh = primitive_around(data.points, init, options.first_vertices, facing=facing)
    near = found is not None and surface is None
    run = Run(
        options, data, report, mesh, mesh, data.target if target is None else target, [], found, surface,
        fallback=mesh if near else None,
    )  # fmt: skip
    run.stages = stages_from(mesh, data, options, cell=found.cell if found and near else None)
    if isinstance(options.handles, list):
        out = add_handles(mesh, pairs=options.handles)
        run.mesh, run.fallback, run.topology = out.mesh, None, replace(run.topology, handles=out.proposals)
    return run


def _wraps(options: Options) -> bool:
    """Return whether the start is to be wrapped around the data, if that is closed."""
    handles = options.handles != "none" and not isinstance(options.handles, list)
    return (
        options.init in ENCLOSING and handles and isinstance(options.holes, str) and options.vertices >= FEWEST_WRAPPED
    )


def _closed_start(data: Input, options: Options) -> Start | None:
    """Return the automatic start of closed connected data; None for open data and where there is none."""
    if border_width(data.target, data.points) >= OPEN:
        return None
    try:
        start = data.start(options.vertices, options.tunnels)
    except TopologyError as error:
        warn(f"no handles are looked for, as the genus of the data is not known: {error}")
        return None
    return start if start[0].n_components == 1 else None


def stages_from(start: SimplexMesh, data: Input, options: Options, *, cell: float | None) -> list[Stage]:
    """Return three stages from an automatic start, found on a grid of cells of this size, and five from farther away.

    Rigidity and reach decrease from the stiff stages over the fine one, where metric parameters adapt, to the last.
    """
    radius = 0.5 * float(np.linalg.norm(np.ptp(data.points, axis=0)))
    edge, rigidity, iterations = mean_edge(start), options.rigidity, options.iterations
    last = max(2 * data.resolution, edge)
    if cell is not None:
        error = max(data.resolution, cell, min(1.2 * edge, 1.5 * data.resolution))  # few vertices are farther off
        near = 1.25 * error if data.encloses else max(3 * data.resolution, 2 * edge)
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
