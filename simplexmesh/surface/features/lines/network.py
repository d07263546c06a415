"""Networks of feature lines: lines, the nodes where they meet, and edits that return new networks."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.drafts import draft
from simplexmesh._base.html import card
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.surface.features import exporting
from simplexmesh.surface.features.lines import walking
from simplexmesh.surface.features.lines.creases import Creases
from simplexmesh.surface.features.lines.edge_sets import Chains
from simplexmesh.surface.features.lines.placing import placed
from simplexmesh.surface.polyline import Polyline

if TYPE_CHECKING:
    import pyvista as pv


@dataclass(frozen=True, eq=False, repr=False)
class FeatureLine(Polyline):
    """A line of a network: a chain of edges of a mesh, between two nodes or closed.

    Attributes
    ----------
    points : (k, 3) array of float
        In order, where the surfaces on both sides meet: beside the mesh's vertices where these are not on the crease.
    edges : (k, 2) array of int
        The vertex of each point, twice, as for every polyline on a surface.
    closed : bool
        Whether the last point is connected to the first.
    kind : str
        "C0": the surface goes on with another normal; "Gn": with the same one, between zones.
    angle : (k,) array of float
        By which the normal turns across the line, in radians.

    Examples
    --------
    >>> import numpy as np, pyvista as pv, simplexmesh as sm
    >>> rim = sm.feature_lines(pv.Cylinder(resolution=60).triangulate().clean()).lines[0]
    >>> rim.kind, rim.closed, rim.points.shape == (len(rim.vertices), 3), f"{np.degrees(rim.angle.mean()):.0f}"
    ('C0', True, True, '90')
    """

    kind: str
    angle: Array

    @property
    def vertices(self) -> Indices:
        """The vertices (k,) of the mesh."""
        return self.edges[:, 0]


@dataclass(frozen=True, eq=False, repr=False)
class FeatureNetwork:
    """The feature lines of a surface, the longest first. An edit returns a new network and leaves the old one.

    Attributes
    ----------
    mesh : TriangleMesh
        The surface whose vertices the lines follow: the one given, with duplicate positions merged.

    Examples
    --------
    >>> import pyvista as pv, simplexmesh as sm
    >>> cube = sm.divided(pv.Cube().triangulate().clean(), 0.1)
    >>> net = sm.feature_lines(cube)
    >>> net
    FeatureNetwork(12 lines, 8 nodes, length 12)
    >>> len(net.without(0).lines)  # two corners are left with two lines each, which become one
    9
    """

    mesh: TriangleMesh
    _found: Creases = field(repr=False)

    def __repr__(self) -> str:
        length = sum(line.length for line in self.lines)
        return f"FeatureNetwork({len(self.lines)} lines, {len(self.nodes)} nodes, length {length:.6g})"

    def _repr_html_(self) -> str:
        """Return a picture of the lines and a table of what they are, as notebooks show them."""
        turned = np.degrees([float(line.angle.mean()) for line in self.lines] or [0.0])
        rows = {
            "lines": f"{len(self)}, {sum(line.closed for line in self.lines)} of them closed",
            "nodes": f"{len(self.nodes)}",
            "length": f"{sum(line.length for line in self.lines):.6g}",
            "angles": f"{turned.min():.3g} to {turned.max():.3g} degrees",
            "noise": f"{self.noise:.3g}",
        }
        return card("Sharp edges", rows, self)

    def __len__(self) -> int:
        return len(self.lines)

    @property
    def noise(self) -> float:
        """The standard deviation of the vertices along the normal that the surface shows, in its unit of length.

        The root mean square of triangles, as regions with at least twice the noise of the whole surface have their own.
        """
        return float(np.sqrt(np.mean(self._found.edges.facets.noise**2)))

    @property
    def _chosen(self) -> Mask:
        """The edges (e,) that are on lines, of the inner ones of the mesh."""
        return self._found.chosen

    @cached_property
    def lines(self) -> tuple[FeatureLine, ...]:
        """The lines, the longest first."""
        return tuple(line for line, _ in self._sorted)

    @cached_property
    def _sorted(self) -> list[tuple[FeatureLine, Indices]]:
        """Lines with their edges."""
        chains = self._found.edges.chains(self._chosen)
        out = [(self._line(chains, k, "C0"), chains.of(k)) for k in range(chains.n_lines)]
        return sorted(out, key=lambda each: -each[0].length)

    def _line(self, chains: Chains, k: int, kind: str) -> FeatureLine:
        """Return one of some lines of edges."""
        along, jumps = chains.along(k), np.maximum(self._found.jumps[chains.of(k)], 0.0)
        closed = bool(along[0] == along[-1])
        at = along[:-1] if closed else along
        before, after = (jumps[-1:], jumps[:1]) if closed else (jumps[:1], jumps[-1:])
        angle = 0.5 * (np.append(before, jumps) + np.append(jumps, after))[: len(at)]
        places, ends, angles = map(checks.frozen, (self._places[at], np.stack([at, at], axis=1), angle))
        return FeatureLine(places, ends, closed, kind, angles)

    @cached_property
    def node_vertices(self) -> Indices:
        """The vertices (m,) where lines end or meet."""
        edges, degrees = self._found.edges, self._found.edges.degrees(self._chosen)
        return checks.frozen(np.flatnonzero((degrees > 0) & ((degrees != 2) | edges.border)))

    @cached_property
    def nodes(self) -> Array:
        """The points (m, 3) where lines end or meet."""
        return checks.frozen(self._places[self.node_vertices])

    @cached_property
    def _places(self) -> Array:
        """The vertices (n, 3) of the mesh, those on lines where the sides meet."""
        to, out = self._centered, self.mesh.vertices.copy()
        moved = (to != self._found.edges.facets.vertices).any(axis=1)
        out[moved] = to[moved] + self.mesh.vertices.mean(axis=0)
        return out

    @cached_property
    def _centered(self) -> Array:
        """Those about their mean, as facets have them."""
        return placed(self._found)

    def without(self, *lines: int | Sequence[int]) -> FeatureNetwork:
        """Return the network without some of its lines; those that met two of them are joined.

        Lines are given by number, one by one or as one sequence.

        Raises
        ------
        ValueError, TypeError
            For a number that is not one of a line.
        """
        chosen = self._chosen.copy()
        for number in checks.integers("line", lines, 0):
            chosen[self._sorted[self._number(number)][1]] = False
        return self._of(chosen)

    def prolonged(self, line: int, *, angle: float) -> FeatureNetwork:
        """Return the network with a line walked on from its free ends, along edges of at least an angle (radians).

        At each vertex the three edges across which the filtered normal turns most are looked at, and of those the one
        whose far vertex bends most; the walk ends at another line, or where none passes (Veron et al. 1998, section 4).

        Raises
        ------
        ValueError, TypeError
            For a number that is not one of a line, a line without free ends, as closed ones, an angle outside (0, pi).
        """
        angle = walking.crease_angle(angle)
        edges = self._sorted[self._number(line)][1]
        return self._of(walking.prolonged(self._found, self._chosen, edges, angle))

    def joined(self, one: int, two: int) -> FeatureNetwork:
        """Return the network with two lines joined from free end to free end, or one closed, along what bends most.

        Raises
        ------
        ValueError, TypeError
            For a number that is not one of a line, or lines without free ends, or unconnected ones.
        """
        pair = (self._sorted[self._number(one)][1], self._sorted[self._number(two)][1])
        return self._of(walking.joined(self._found, self._chosen, *pair))

    def _of(self, chosen: Mask) -> FeatureNetwork:
        """Return the network of other edges."""
        return replace(self, _found=self._found.creases_at(chosen))

    def _number(self, number: int) -> int:
        """Return the number of a line, checked."""
        if not len(self):
            raise ValueError("the network has no lines")
        return checks.integer("line", number, 0, len(self) - 1)

    def as_dict(self) -> dict[str, Any]:
        """Return nodes and lines as plain lists and numbers: what the JSON file holds."""
        index = {int(v): k for k, v in enumerate(self.node_vertices)}
        lines = [
            {
                "kind": line.kind,
                "closed": line.closed,
                "nodes": [index[int(v)] for v in line.vertices[[0, -1]] if int(v) in index],
                "length": line.length,
                "angle": line.angle.tolist(),
                "vertices": line.vertices.tolist(),
                "points": line.points.tolist(),
            }
            for line in self.lines
        ]
        return {"nodes": self.nodes.tolist(), "lines": lines}

    def to_pyvista(self) -> pv.PolyData:
        """Return the lines as PyVista's; cells have their number as "line", points their "angle" in radians."""
        return exporting.polylines(self.lines)

    def save(self, path: str | Path) -> None:
        """Write the lines: `.json` (nodes, lines, kinds, angles) or `.vtp` (typed polylines).

        Raises
        ------
        ValueError
            For another extension.
        OSError
            When the file cannot be written; an older one is then as it was.
        """
        path = checks.path("path", path)
        if path.suffix.lower() == ".json":
            with draft(path) as place:
                place.write_text(json.dumps(self.as_dict(), indent=1))
        elif path.suffix.lower() == ".vtp":
            with draft(path) as place:
                self.to_pyvista().save(place)
        else:
            raise ValueError(f"path must end in .json or .vtp, not {path.name!r}")
