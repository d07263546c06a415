"""Lines near a mesh traced along its own edges: the vertices of each, and their places on the line."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.sparse import diags_array
from scipy.sparse.linalg import spsolve
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import norm
from simplexmesh.mesh.paths import refusal_of_path
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.creases.line import CreaseLine, at_distances
from simplexmesh.motion.creases.tracing import Corner, Tracing, corners
from simplexmesh.motion.model.state import mean_edge

STEP = 0.1
"""Distance of the samples of lines, in mean edges."""

JOINED = 0.2
"""Share of their distances that the vertices of a corner of more than three lines keep from each other."""

NARROWED = 0.7
"""Share by which the distance of two vertices along a line may be less than the mean one."""


@dataclass(frozen=True)
class Path:
    """Vertices (k,) of a mesh, each joined to the next by an edge, and their places (k, 3) on a line of some.

    The line -1 is the edge between two vertices of one corner.
    """

    line: int
    vertices: Indices
    places: Array
    closed: bool

    @property
    def steps(self) -> Indices:
        """The pairs of vertices (m, 2) along it."""
        return np.stack([self.vertices, np.roll(self.vertices, -1)], axis=1)[: len(self.vertices) - (not self.closed)]

    def pieces(self, kept: Mask) -> list[Path]:
        """Return the parts of it, of two vertices or more, whose vertices are in a mask (n,)."""
        inside = kept[self.vertices]
        if inside.all():
            return [self]
        turn = int(np.argmin(inside)) if self.closed else 0  # a closed one is opened in a gap
        rows = np.roll(np.arange(len(inside)), -turn)
        runs = np.split(rows, np.flatnonzero(np.diff(inside[rows])) + 1)
        return [
            Path(self.line, self.vertices[run], self.places[run], closed=False)
            for run in runs
            if inside[run[0]] and len(run) > 1
        ]


def traced(mesh: SimplexMesh, lines: Sequence[CreaseLine], resolution: float) -> list[Path]:
    """Return the paths of lines found on a surface of some resolution; those that find no way have none.

    Open lines with an end in common leave it in the order in which they lie around it: three by the edges of a vertex,
    n by those of n - 2 vertices. The shortest lines come first; others go along with them where there is no other way,
    and their paths are the pieces that are left.
    """
    trace = Tracing(mesh, resolution)
    at = corners(trace, lines)
    whole: dict[int, Indices] = {}
    for k in np.argsort([line.length for line in lines]).tolist():
        line = lines[k]
        found = _closed_path(trace, line) if line.closed else _open_path(trace, line, at[k, 0], at[k, 1], k)
        if not refusal_of_path(found, mesh.neighbors[found], closed=line.closed):
            whole[k] = found
            trace.taken[found] = True
    return list(_pieces(mesh, lines, whole, at.values()))


def _open_path(trace: Tracing, line: CreaseLine, start: Corner | None, end: Corner | None, number: int) -> Indices:
    """Return the path of an open line, given by its number, from one corner to another."""
    if start is None or end is None or start is end:
        return np.zeros(0, np.int64)
    (first, out), (last, into) = start.exits[number, 0], end.exits[number, 1]
    own = [*start.vertices, *end.vertices]
    if out in end.vertices:
        return np.array([first, out])
    if into in start.vertices:
        return np.array([into, last])
    leg = [out] if out == into else _through(trace, line, out, into, own)
    return np.array([first, *leg, last] if leg else [], np.int64)


def _closed_path(trace: Tracing, line: CreaseLine) -> Indices:
    """Return the path of a closed line from the vertex nearest to its first point."""
    for start in trace.free(line.points[0])[:1]:
        return np.array(_through(trace, line, start, start, [])[:-1], np.int64)
    return np.zeros(0, np.int64)


def _through(trace: Tracing, line: CreaseLine, start: int, end: int, own: list[int]) -> list[int]:
    """Return the path between vertices along a line, of one that comes round by way of two stops; empty if none."""
    samples, along = line.samples(STEP * trace.edge)
    round_about = norm(samples[-1] - samples[0]) < 0.5 * along[-1]
    bounds = np.linspace(0, len(samples) - 1, 4 if round_about else 2).astype(int)
    out = [start]
    for k, (low, high) in enumerate(pairwise(bounds.tolist())):
        used = {*own, *out}
        stops = [end] if k == len(bounds) - 2 else [v for v in trace.free(samples[high]) if v not in used | {end}]
        leg = trace.leg(out[-1], stops[0], samples[low : high + 1], [*used, end]) if stops else []
        if not leg:
            return []
        out += leg[1:]
    return out


def _pieces(
    mesh: SimplexMesh, lines: Sequence[CreaseLine], whole: dict[int, Indices], at: Iterable[Corner | None]
) -> Iterator[Path]:
    """Yield the edges within corners, and the pieces of whole paths, from corner to corner, that none before has."""
    places: dict[int, Array] = {}
    ties: list[tuple[int, int]] = []
    for corner in {id(each): each for each in at if each is not None}.values():
        middle = mesh.vertices[corner.vertices].mean(axis=0)
        places |= {v: corner.place + JOINED * (mesh.vertices[v] - middle) for v in corner.vertices}
        ties += [(v, n) for v in corner.vertices for n in corner.vertices if v < n and n in mesh.neighbors[v]]
    yield from (Path(-1, np.array(tie), np.array([places[v] for v in tie]), closed=False) for tie in ties)
    edges = [{(min(step), max(step)) for step in _steps(path, closed=lines[k].closed)} for k, path in whole.items()]
    degree = np.bincount(np.array([*set().union(ties, *edges)], np.int64).ravel(), minlength=mesh.n_vertices)
    used: set[tuple[int, int]] = set()
    edge = mean_edge(mesh)
    for k, path in whole.items():
        for v, place in zip(path.tolist(), _places(mesh.vertices[path], lines[k], edge), strict=True):
            places.setdefault(v, place)
        steps = _steps(path, closed=lines[k].closed)
        stops = [i for i, (v, _) in enumerate(steps) if degree[v] != 2]
        if lines[k].closed and stops:
            steps = steps[stops[0] :] + steps[: stops[0]]
        run: list[int] = []
        for v, w in [*steps, (-1, -1)]:
            new = v >= 0 and (min(v, w), max(v, w)) not in used
            if run and (not new or degree[v] != 2):
                closed = len(run) > 2 and run[0] == run[-1]
                on = np.array(run[: len(run) - closed])
                yield Path(k, on, np.array([places[i] for i in on.tolist()]), closed)
                run = []
            if new:
                used.add((min(v, w), max(v, w)))
                run = [*(run or [v]), w]


def _steps(path: Indices, *, closed: bool) -> list[tuple[int, int]]:
    """Return the pairs of vertices along a path."""
    return list(pairwise([*path.tolist(), *path[: int(closed)].tolist()]))


def respaced(mesh: SimplexMesh, paths: Sequence[Path]) -> Array:
    """Return the vertices (n, 3) with those of paths spread along these, in their order."""
    vertices, edge = mesh.vertices.copy(), mean_edge(mesh)
    for path in paths:
        vertices[path.vertices] = _places(
            mesh.vertices[path.vertices], CreaseLine(mesh.vertices[path.vertices], path.closed, 0.0), edge
        )
    return vertices


def _places(vertices: Array, line: CreaseLine, edge: float) -> Array:
    """Return places (k, 3) on a line for vertices (k, 3) in their order, as near to them as evenly spread."""
    samples, along = line.samples(STEP * edge)
    whole, count = along[-1], len(vertices)
    nearest = along[cKDTree(samples[: len(samples) - line.closed]).query(vertices)[1]]
    if line.closed:
        nearest = np.unwrap(nearest, period=whole)
        step = np.copysign(whole, nearest[-1] - nearest[0]) / count
        links = diags_array([-1.0, 1.0, 1.0], offsets=[0, 1, 1 - count], shape=(count, count))
    else:
        step, links = whole / (count - 1), diags_array([-1.0, 1.0], offsets=[0, 1], shape=(count - 1, count))
    off = nearest - step * np.arange(count)
    held = np.ones(count)
    if not line.closed:
        off[[0, -1]], held[[0, -1]] = 0.0, 1e6
    for evenness in 4.0 ** np.arange(8):
        shift = spsolve((diags_array(held) + evenness * links.T @ links).tocsc(), held * off)
        if (np.copysign(1.0, step) * (links @ shift)[: count - 1] > -NARROWED * abs(step)).all():
            break
    out = step * np.arange(count) + shift
    return at_distances(samples, along, out % whole if line.closed else np.clip(out, 0.0, whole))


def on_paths(paths: Sequence[Path], count: int) -> Mask:
    """Return the vertices (count,) on paths."""
    out = np.zeros(count, bool)
    for path in paths:
        out[path.vertices] = True
    return out
