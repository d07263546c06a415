"""The step of a reconstruction that gives the model the sharp edges of its data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simplexmesh._base.errors import warn
from simplexmesh._base.progress import Progress
from simplexmesh._base.vectors import cross, dot
from simplexmesh.data.cutting.boolean import united
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.mesh._kernels import component_labels
from simplexmesh.mesh.contours import Contour, numbered
from simplexmesh.mesh.manifold import half_edge_mates
from simplexmesh.motion.creases.own import model_along, sharp_edges
from simplexmesh.motion.creases.sharpening import Sharpened, sharpened, sharpened_volume
from simplexmesh.motion.model.state import mean_edge
from simplexmesh.motion.reconstruct.inputs import Input, TrianglesInput
from simplexmesh.motion.reconstruct.measure import share_of_area
from simplexmesh.motion.reconstruct.options import Options, stages_from
from simplexmesh.motion.reconstruct.result import LEAST_BARE
from simplexmesh.motion.reconstruct.run import Run
from simplexmesh.motion.start.solid_mesh import edge_length
from simplexmesh.motion.targets.isosurface import Isosurface
from simplexmesh.motion.targets.labels import LabelSurface
from simplexmesh.motion.targets.triangles import Triangles, inside_surface, surface_distance

MOST_POINTS = 40_000
"""Of the surface of a volume, drawn at random, for its sharp edges."""

STEEPEST = np.pi / 4
"""Steps of one voxel bend a labeled surface by up to as much at the rims of its flat terraces."""

TOLD = 0.9
"""Share of the length of the sharp edges below which a warning tells it: gaps at corners are shorter."""

SAMPLES = 40_000
"""Points of the other bodies, besides their vertices, that tell whether one of them crosses the largest."""


def along_edges(data: Input, options: Options, report: Progress) -> Run | None:
    """Return the model of closed triangles made along their sharp edges, near them as it is; None where that fails."""
    if not (isinstance(data, TrianglesInput) and options.is_plain and data.oriented):
        return None
    body: TriangleMesh | None = data.source
    if data.leaves_bodies:
        body = united(data.source)
        if body.n_components > 1:
            body = largest_body(body, edge_length(body.area, options.vertices))
    if body is None or body.volume <= 0:
        return None
    points = (data.samples() if body is data.source else body.sampled(len(data.samples()))).points
    made = model_along(Triangles(body), points, options.vertices, report)
    if made is None:
        return None
    found, tangled = made
    run = Run(options, data, report, found.mesh, found.mesh, data.target, [], converged=True)
    run.stages = stages_from(found.mesh, data, options, cell=mean_edge(found.mesh))
    _take(run, found, tangled)
    return run


def largest_body(surface: TriangleMesh, apart: float) -> TriangleMesh | None:
    """Return the body of most volume of a closed oriented surface.

    None where another one crosses it, or is outside and nearer than a length.
    """
    vertices, faces = surface.vertices - surface.vertices.mean(axis=0), surface.faces
    body = component_labels((half_edge_mates(faces) // 3).astype(np.int32))
    a, b, c = vertices[faces].transpose(1, 0, 2)
    largest = body == np.bincount(body, dot(a, cross(b, c))).argmax()
    body_of_vertex = np.zeros(len(vertices))
    body_of_vertex[faces] = body[:, None]
    rest = TriangleMesh(vertices, faces[~largest], {"body": body_of_vertex})
    samples, corners = rest.sampled(SAMPLES), np.unique(rest.faces)
    points = np.concatenate([samples.points, vertices[corners]])
    owners = np.concatenate([samples.data["body"], body_of_vertex[corners]]).round().astype(int)
    within = inside_surface(points, vertices, faces[largest])
    inside, count = np.bincount(owners, within), np.bincount(owners)
    if ((inside > 0) & (inside < count)).any():
        return None
    if not within.all() and surface_distance(points[~within], vertices, faces[largest]).min() < apart:
        return None
    return TriangleMesh(surface.vertices, faces[largest], {}, surface.unit)


def sharpen(run: Run) -> None:
    """Bring edges of a closed model onto the creases of its data, if it has any and nothing tangles."""
    target = run.target
    if run.options.creases == "none" or run.mesh.n_holes or not run.stages[-1].iterations:
        return
    run.report(0.93, "looking for sharp edges")
    volume, reach = isinstance(target, Isosurface | LabelSurface), run.stages[-1].reach
    if not volume:
        bare = run.tree.query(run.mesh.vertices, workers=-1)[0] > 2 * reach
        if share_of_area(run.mesh, bare) >= LEAST_BARE:
            return  # the rim of a lid is no crease of the data
    points = run.points if volume else run.data.samples().points
    away = run.away(points)
    rows = np.flatnonzero(away <= reach)  # inner walls and other bodies have no creases of the model
    if not len(rows) or np.median(away[rows]) > run.mesh.diagonal:  # it shrank to a place
        return
    if volume:
        rows = np.random.default_rng(0).permutation(rows)[:MOST_POINTS]
    if isinstance(target, Isosurface):
        found = sharpened_volume(run.mesh, points[rows], away[rows], target)
    else:
        least = STEEPEST if volume else 0.0
        found = sharpened(run.mesh, points[rows], away[rows], target, least_angle=least)
    if found is not None:
        _take(run, replace(found, sought=_length_of(run.data) or found.sought), 0)


def _length_of(data: Input) -> float:
    """Return the length of the sharp edges of a closed body, which its triangles tell better than points on them."""
    if not isinstance(data, TrianglesInput) or not data.oriented or data.leaves_bodies:
        return 0.0
    known = sharp_edges(data.source)
    return sum(line.length for line in known.lines) if known is not None else 0.0


def _take(run: Run, found: Sharpened, tangled: int) -> None:
    """Make a model with creases that of a run, and tell if many are missing; so many of its vertices are tangled."""
    if found.share < TOLD:
        held = f"only {found.share:.0%} of the sharp edges of the data are in the model"
        warn(f"{held}; more vertices may hold the others")
    run.target, run.creases, run.tangled = found.target, found.creases(), tangled
    stale = dict.fromkeys(name for name in found.mesh.contours if name.startswith("crease_"))
    lines = [Contour(found.mesh, line.vertices, line.closed) for line in run.creases]
    run.mesh = numbered(found.mesh.with_contours(**stale), "crease", lines)
