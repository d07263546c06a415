"""Lines near a mesh traced along its own edges: the vertices of each, and their places on the line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np
from scipy.sparse import csr_array, diags_array
from scipy.sparse.csgraph import dijkstra
from scipy.sparse.linalg import spsolve
from scipy.spatial import cKDTree

from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.vectors import dot, norm, normalized
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.creases.lines import CreaseLine, at_distances
from simplexmesh.motion.model.state import mean_edge

NEAR = 2.5
"""In mean edges: paths keep as close to their lines."""

DETOUR = 4.0
"""Cost of a step beside the line by an edge, in lengths of the step, less one."""

STEP = 0.1
"""Distance of the samples of lines, in mean edges."""

AHEAD = 1.5
"""In mean edges along a line from its end: the direction in which it leaves."""

NARROWED = 0.7
"""Share by which the distance of two vertices along a line may be less than the mean one."""

ROUNDS = 6
"""Of tracing, while lines find no way."""

End = tuple[int, int]


@dataclass(frozen=True)
class Path:
    """Vertices (k,) of a mesh, each joined to the next by an edge, and their places (k, 3) on a line of some."""

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


def traced(mesh: SimplexMesh, lines: Sequence[CreaseLine]) -> list[Path]:
    """Return the paths of lines; of lines that find no way none.

    Open lines with an end in common share the vertex there, a node. Where two or three meet they leave it by different
    edges, in the order in which they lie around it. Other vertices are on one path only. The shortest lines come first,
    but once more those before that others leave no way; of all rounds the one with most length is returned.
    """
    order = np.argsort([line.length for line in lines]).tolist()
    best: list[Path] = []
    for _ in range(ROUNDS):
        paths = _traced_in_order(mesh, lines, order)
        if _length(paths, lines) > _length(best, lines):
            best = paths
        blocked = [k for k in order if k not in {path.line for path in paths}]
        if not blocked:
            break
        order = blocked + [k for k in order if k not in blocked]
    return best


def _length(paths: Sequence[Path], lines: Sequence[CreaseLine]) -> float:
    """Return the length of the lines that have a path."""
    return sum(lines[path.line].length for path in paths)


def _traced_in_order(mesh: SimplexMesh, lines: Sequence[CreaseLine], order: Sequence[int]) -> list[Path]:
    """Return the paths of lines that find a way beside those before them."""
    trace = Tracing(mesh)
    nodes, ends = _nodes(lines)
    at = [trace.claimed(node) for node in nodes]
    exits = _exits(trace, lines, ends, at)
    trace.taken[list(exits.values())] = True
    out = []
    for k in order:
        line = lines[k]
        if line.closed:
            found = _closed_path(trace, line)
        else:
            first, last = (at[node] for node in ends[k])
            found = _open_path(trace, line, first, last, exits.get((k, 0), first), exits.get((k, 1), last))
        if len(found) > 2 - (not line.closed):
            trace.taken[found] = True
            out.append(Path(k, found, _places(mesh, found, line), line.closed))
    return out


class Tracing:
    """Lines being traced on a mesh; `taken` (n,) are the vertices on paths, at nodes, and by which paths leave them."""

    def __init__(self, mesh: SimplexMesh) -> None:
        self.mesh, self.edge = mesh, mean_edge(mesh)
        self.taken = np.zeros(mesh.n_vertices, bool)
        self._ends = mesh.connectivity.edge_vertices.astype(np.int64)
        self._lengths = norm(mesh.vertices[self._ends[:, 0]] - mesh.vertices[self._ends[:, 1]])
        self._tree = cKDTree(mesh.vertices)

    def claimed(self, place: Array) -> int:
        """Return the nearest vertex not taken, and take it; -1 if none is near."""
        near = np.asarray(self._tree.query_ball_point(place, NEAR * self.edge), np.int64)
        near = near[~self.taken[near]]
        if not len(near):
            return -1
        nearest = int(near[norm(self.mesh.vertices[near] - place).argmin()])
        self.taken[nearest] = True
        return nearest

    def leg(self, start: int, end: int, samples: Array) -> Indices:
        """Return the vertices of the shortest path from one to another near a line; empty if there is none."""
        widest = NEAR * self.edge
        away, _ = cKDTree(samples).query(self.mesh.vertices, distance_upper_bound=widest)
        usable = np.isfinite(away) & ~self.taken
        usable[[start, end]] = True
        inside = np.flatnonzero(usable[self._ends].all(axis=1))
        a, b = self._ends[inside].T
        beside = np.minimum(away, widest)
        cost = self._lengths[inside] * (1 + DETOUR * (0.5 * (beside[a] + beside[b]) / self.edge) ** 2)
        n = len(away)
        graph = csr_array((cost, (a, b)), shape=(n, n))
        _, before = dijkstra(graph, directed=False, indices=start, return_predecessors=True)
        leg = [end]
        while leg[-1] != start:
            if before[leg[-1]] < 0:
                return np.zeros(0, np.int64)
            leg.append(int(before[leg[-1]]))
        return np.array(leg[::-1])


def _nodes(lines: Sequence[CreaseLine]) -> tuple[Array, dict[int, End]]:
    """Return the ends (m, 3) of open lines, equal ones once, and the two of each open line."""
    numbers = [k for k, line in enumerate(lines) if not line.closed]
    places = np.array([lines[k].points[[0, -1]] for k in numbers]).reshape(-1, 3)
    nodes, which = np.unique(places, axis=0, return_inverse=True)
    return nodes, {k: (int(one), int(two)) for k, (one, two) in zip(numbers, which.reshape(-1, 2), strict=True)}


def _exits(trace: Tracing, lines: Sequence[CreaseLine], ends: dict[int, End], at: list[int]) -> dict[End, int]:
    """Return the neighbor by which a line, at its first or last end, leaves a node where two or three meet."""
    meeting: dict[int, list[End]] = {}
    for k, both in ends.items():
        for last, node in enumerate(both):
            meeting.setdefault(node, []).append((k, last))
    out: dict[End, int] = {}
    for node, those in meeting.items():
        vertex = at[node]
        if vertex < 0 or not 2 <= len(those) <= 3:
            continue
        around = trace.mesh.neighbors[vertex].astype(np.int64)
        towards = np.array([_ahead(lines[k].points[:: -1 if last else 1], AHEAD * trace.edge) for k, last in those])
        edges = trace.mesh.vertices[around] - trace.mesh.vertices[vertex]
        near = trace.mesh.neighbors[trace.mesh.neighbors[around]]  # one vertex of a corner may face anywhere
        chosen = _matched(edges, towards, normalized(trace.mesh.normals[near].sum(axis=(0, 1, 2))))
        out |= {end: int(around[place]) for end, place in zip(those, chosen, strict=True)}
    return out


def _ahead(points: Array, distance: float) -> Array:
    """Return the way (3,) from the first of some points to the place at a distance along them, or to the last."""
    far = np.append(0.0, np.cumsum(norm(np.diff(points, axis=0))))
    return at_distances(points, far, np.array([distance]))[0] - points[0]


def _matched(edges: Array, towards: Array, normal: Array) -> tuple[int, ...]:
    """Return which of the edges (3, 3) around a normal lie best along directions (2 or 3, 3), in the same order."""
    edges, towards = (normalized(each - dot(each, normal[None])[:, None] * normal) for each in (edges, towards))
    orders = list(permutations(range(3), len(towards)))
    if len(towards) == 3:  # edges are counter-clockwise; directions keep their order around the normal
        aside = np.cross(normal, edges[0])
        rank = np.argsort(np.argsort(np.arctan2(towards @ aside, towards @ edges[0])))
        orders = [(int(a), int(b), int(c)) for a, b, c in ((rank + turn) % 3 for turn in range(3))]
    fit = towards @ edges.T
    return max(orders, key=lambda order: sum(fit[k, place] for k, place in enumerate(order)))


def _open_path(trace: Tracing, line: CreaseLine, first: int, last: int, start: int, end: int) -> Indices:
    """Return the path of a line between nodes, which it leaves by given neighbors, or by any if these are the nodes."""
    if first < 0 or last < 0 or first == last:
        return np.zeros(0, np.int64)
    if start == last or end == first:
        return np.array([first, last])
    leg = np.array([start]) if start == end else _through(trace, line, start, end)
    if not len(leg):
        return leg
    return np.concatenate([[first] * (start != first), leg, [last] * (end != last)]).astype(np.int64)


def _closed_path(trace: Tracing, line: CreaseLine) -> Indices:
    """Return the path of a closed line from the vertex nearest to its first point."""
    start = trace.claimed(line.points[0])
    leg = _through(trace, line, start, start) if start >= 0 else np.zeros(0, np.int64)
    if start >= 0 and not len(leg):
        trace.taken[start] = False
    return leg[:-1]


def _through(trace: Tracing, line: CreaseLine, start: int, end: int) -> Indices:
    """Return the path between vertices along a line, of one that comes round by way of two stops; empty if none."""
    samples, along = line.samples(STEP * trace.edge)
    round_about = norm(samples[-1] - samples[0]) < 0.5 * along[-1]
    bounds = np.linspace(0, len(samples) - 1, 4 if round_about else 2).astype(int)
    before = trace.taken.copy()
    stops = [start, *(trace.claimed(samples[row]) for row in bounds[1:-1]), end]
    out = [start]
    for k, stop in enumerate(stops[1:]):
        leg = trace.leg(out[-1], stop, samples[bounds[k] : bounds[k + 1] + 1]) if stop >= 0 else np.zeros(0, np.int64)
        if not len(leg):
            trace.taken = before
            return np.zeros(0, np.int64)
        trace.taken[leg] = True
        out.extend(leg[1:])
    return np.array(out)


def respaced(mesh: SimplexMesh, paths: Sequence[Path]) -> Array:
    """Return the vertices (n, 3) with those of paths spread along these, in their order."""
    vertices = mesh.vertices.copy()
    for path in paths:
        vertices[path.vertices] = _places(
            mesh, path.vertices, CreaseLine(mesh.vertices[path.vertices], path.closed, 0.0)
        )
    return vertices


def _places(mesh: SimplexMesh, path: Indices, line: CreaseLine) -> Array:
    """Return places (k, 3) on a line for the vertices of a path in their order, as near to them as evenly spread."""
    samples, along = line.samples(STEP * mean_edge(mesh))
    whole, count = along[-1], len(path)
    nearest = along[cKDTree(samples[: len(samples) - line.closed]).query(mesh.vertices[path])[1]]
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
