"""Zones of a surface: what they are, their boundaries, edits and files."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.drafts import draft
from simplexmesh._base.html import card
from simplexmesh._base.named_arrays import taken
from simplexmesh.data.triangles import TriangleMesh
from simplexmesh.surface.features import exporting
from simplexmesh.surface.features.lines.network import FeatureLine, FeatureNetwork
from simplexmesh.surface.features.zoning import edits
from simplexmesh.surface.features.zoning._kernels_fronts import grow
from simplexmesh.surface.features.zoning.bending import bending
from simplexmesh.surface.features.zoning.kinds import FREE, kind_of
from simplexmesh.surface.features.zoning.straddling import sided

if TYPE_CHECKING:
    import pyvista as pv


LEAST_INNER = 12
"""Vertices inside a zone, or triangles; with fewer, those on a boundary that they may straddle are looked at too."""


@dataclass(frozen=True, eq=False, repr=False)
class Zones:
    """A surface divided into zones, the largest first. An edit returns new zones, numbered so, and leaves the old ones.

    Attributes
    ----------
    mesh : TriangleMesh
        The surface: the one given, with duplicate positions merged.
    network : FeatureNetwork
        The sharp edges between zones.
    labels : (t,) array of int
        The zone of each triangle; of one that straddles a sharp edge, the zone on whose side its center lies.

    Examples
    --------
    >>> import pyvista as pv, simplexmesh as sm
    >>> can = sm.zones(pv.Cylinder(resolution=60).triangulate().clean())
    >>> can, can.kinds
    (Zones(3 zones of 236 triangles), ('cylinder', 'plane', 'plane'))
    >>> len(can.merged(1, 0))
    2
    """

    network: FeatureNetwork
    labels: Indices = field(repr=False)
    _parts: Indices = field(repr=False)

    def __repr__(self) -> str:
        return f"Zones({len(self)} zones of {len(self._parts):,} triangles)"

    def _repr_html_(self) -> str:
        """Return a picture of the zones and a table of their kinds, as notebooks show them."""
        kinds = np.array(self.kinds)
        rows = {
            str(kind): f"{(kinds == kind).sum()}, area {self.areas[kinds == kind].sum():.4g}" for kind in set(kinds)
        }
        return card(f"{len(self)} zones", dict(sorted(rows.items())), self)

    def __len__(self) -> int:
        return int(self._parts.max()) + 1

    @property
    def mesh(self) -> TriangleMesh:
        """The surface."""
        return self.network.mesh

    @cached_property
    def areas(self) -> Array:
        """The area (z,) of each zone, in the surface's unit squared."""
        return checks.frozen(np.bincount(self.labels, self.network._found.edges.facets.areas))

    @cached_property
    def _fits(self) -> list[tuple[str, float]]:
        """The kind and rms of each zone; rims on chords of a clean ball make it a free form, which it is not inside."""
        every = np.arange(self.mesh.n_vertices)
        clear, inside = (np.isin(every, off, invert=True) for off in (self._astride, self._between))
        out = []
        for k in range(len(self)):
            fit = self._fit(k, clear, clear)
            within = self._fit(k, inside, clear) if fit[0] == FREE else fit
            out.append(fit if within[0] == FREE else within)
        return out

    def _fit(self, zone: int, inner: Mask, clear: Mask) -> tuple[str, float]:
        """Return the kind and rms of a zone from its `inner` vertices if they are enough; `clear` ones are near it."""
        found, vertices, faces = self.network._found, self.mesh.vertices, self.mesh.faces
        triangles = np.flatnonzero(self.labels == zone)
        corners = np.unique(faces[triangles])
        points, rims = vertices[_most_inside(corners, inner)], vertices[corners[(clear & ~inner)[corners]]]
        triangles = _most_inside(triangles, np.all(inner[faces], axis=1))
        noise = float(found.edges.facets.noise[triangles].mean())
        return kind_of(points, vertices[faces[triangles]].mean(axis=1), found.normals[triangles], noise, rims)

    @property
    def kinds(self) -> tuple[str, ...]:
        """What each zone is: "plane", "cylinder", "sphere", "cone", "torus" or "free form"."""
        return tuple(kind for kind, _ in self._fits)

    @property
    def errors(self) -> Array:
        """The rms distance (z,) of the vertices from the fit of that kind, of a free form from the nearest of all."""
        return np.array([error for _, error in self._fits])

    @property
    def _between(self) -> Indices:
        """Vertices between zones, or on sharp edges."""
        edges = self.network._found.edges
        across = self.labels[edges.sides[:, 0]] != self.labels[edges.sides[:, 1]]
        return np.unique(edges.ends[across | self.network._chosen])

    @property
    def _astride(self) -> Indices:
        """Vertices between zones that may be on neither side: where triangles may straddle the edge, or none is."""
        found, sharp, edges = self.network._found, self.network._chosen, self.network._found.edges
        across = self.labels[edges.sides[:, 0]] != self.labels[edges.sides[:, 1]]
        vague = found.straddling(sharp)[edges.sides].any(axis=1)
        return np.unique(edges.ends[np.where(sharp, vague, across)])

    @cached_property
    def boundaries(self) -> tuple[tuple[FeatureLine, tuple[int, int]], ...]:
        """The lines between zones and the numbers of both, "C0" where the surface has a sharp edge and "Gn" elsewhere.

        A sharp edge that ends inside a zone has that zone on both sides. Rims of the surface, whose other side is
        undefined, are none of them.
        """
        edges, sharp = self.network._found.edges, self.network._chosen
        pair = np.sort(self._parts[edges.sides], axis=1)
        smooth = (pair[:, 0] != pair[:, 1]) & ~sharp
        nodes = (edges.degrees(sharp | smooth) != 2) | (edges.degrees(sharp) == 1)
        out = []
        for kind, mask in (("C0", sharp), ("Gn", smooth)):
            chains = edges.chains(mask, nodes)
            for k in range(chains.n_lines):
                one, two = pair[chains.of(k)[0]].tolist()
                out.append((self.network._line(chains, k, kind), (one, two)))
        return tuple(out)

    def patches(self) -> tuple[TriangleMesh, ...]:
        """Return a mesh of each zone."""
        out = []
        for k in range(len(self)):
            used, index = np.unique(self.mesh.faces[self.labels == k], return_inverse=True)
            used = np.append(used, np.repeat(used[-1:], max(0, 4 - len(used))))  # a mesh has at least four vertices
            arrays = taken(self.mesh.data, used)
            out.append(TriangleMesh(self.mesh.vertices[used], index.reshape(-1, 3), arrays, self.mesh.unit))
        return tuple(out)

    def merged(self, *zones: int | Sequence[int]) -> Zones:
        """Return the zones with some made one, given by number, one by one or as one sequence.

        Raises
        ------
        ValueError, TypeError
            For fewer than two numbers, one that is not of a zone, or zones that do not touch.
        """
        numbers = np.array(checks.integers("zone", zones, 0, len(self) - 1), np.int64)
        if len(set(numbers.tolist())) < 2:
            raise ValueError(f"zones to merge must be at least two, not {len(set(numbers.tolist()))}")
        labels = np.where(np.isin(self._parts, numbers), numbers[0], self._parts)
        pieces = edits.in_pieces(labels, self.network._found.edges)
        if len(np.unique(pieces[labels == numbers[0]])) > 1:
            raise ValueError(f"zones to merge must touch, but {', '.join(map(str, numbers))} do not all")
        return self._with(labels)

    def grown(self, zone: int, *, tolerance: float) -> Zones:
        """Return the zones with one grown over its neighbors, up to sharp edges, where these bend as it does.

        Parameters
        ----------
        zone : int
            Its number.
        tolerance : float
            A curvature, 1 / length, not a length: by how much that of a neighbor, the root of the sum of the squared
            principal curvatures, may differ from the zone's mean.

        Raises
        ------
        ValueError, TypeError
            For a number that is not one of a zone, or a tolerance that is not above 0.
        """
        number = self._number(zone)
        tolerance = checks.number("tolerance", tolerance, 0.0, open_low=True)
        found, sharp = self.network._found, self.network._chosen
        values = bending(found, found.edges.zones(sharp))
        inside = self._parts == number
        weights = found.edges.facets.areas[inside]
        values = np.where(inside, np.average(values[inside], weights=weights), values)
        taken_over = np.full(len(values), -1)
        mates, closed = found.edges.facets.mates, found.edges.halved(sharp)
        grow(taken_over, np.flatnonzero(inside), values, tolerance, mates, closed)
        return self._with(np.where(taken_over >= 0, number, self._parts))

    def without(self, *zones: int | Sequence[int]) -> Zones:
        """Return the zones without some, given one by one or as a sequence, whose triangles their neighbors take over.

        Raises
        ------
        ValueError, TypeError
            For a number that is not one of a zone, or all of them.
        """
        gone = np.zeros(len(self), bool)
        gone[checks.integers("zone", zones, 0, len(self) - 1)] = True
        if gone.all():
            raise ValueError("zones must be left: not all can be taken away")
        return self._with(edits.dissolved(self._parts, gone, self.network._found.edges, self.network._chosen))

    def without_small(self, *, faces: int) -> Zones:
        """Return the zones without those of fewer triangles, which their neighbors take over, the smallest first.

        Zones that touch no other stay. As after every edit, those left are numbered anew, the largest 0.

        Raises
        ------
        ValueError, TypeError
            For a count that is not a whole number of at least 1.
        """
        least = checks.integer("faces", faces, 1)
        edges, sharp = self.network._found.edges, self.network._chosen
        return self._with(edits.without_small(self._parts, least, edges, sharp))

    def smoothed(self) -> Zones:
        """Return the zones with shorter boundaries: single triangles change sides, never across a sharp edge."""
        return self._with(edits.smoothed(self._parts, self.network._found.edges, self.network._chosen))

    def _with(self, parts: Indices) -> Zones:
        """Return zones of other labels, each connected."""
        return zoned(self.network, edits.in_pieces(parts, self.network._found.edges))

    def _number(self, number: int) -> int:
        """Return the number of a zone, checked."""
        return checks.integer("zone", number, 0, len(self) - 1)

    def as_dict(self) -> dict[str, Any]:
        """Return zones and boundaries as plain lists and numbers: what the JSON file holds."""
        counts = np.bincount(self.labels)
        rows = zip(self.kinds, self.errors.tolist(), self.areas.tolist(), counts.tolist(), strict=True)
        zones = [
            {"kind": kind, "rms": rms if np.isfinite(rms) else None, "area": area, "triangles": n}
            for kind, rms, area, n in rows
        ]
        ends = [[] if line.closed else line.vertices[[0, -1]].tolist() for line, _ in self.boundaries]
        nodes = np.unique([int(v) for pair in ends for v in pair]).astype(np.int64)
        lines = [
            {
                "kind": line.kind,
                "zones": pair,
                "closed": line.closed,
                "nodes": np.searchsorted(nodes, at).tolist(),
                "angle": line.angle.tolist(),
                "points": line.points.tolist(),
            }
            for (line, pair), at in zip(self.boundaries, ends, strict=True)
        ]
        places = self.network._places[nodes].tolist()
        return {"zones": zones, "nodes": places, "boundaries": lines, "labels": self.labels.tolist()}

    def to_pyvista(self) -> pv.PolyData:
        """Return the surface and the lines between zones as PyVista's; cells have a "zone", or a "line" and a "kind".

        Of lines these are their numbers in `boundaries` and in the array "kinds" of the data set, and "zones" are those
        on both sides; -1 where a cell has none.
        """
        return exporting.zoned(self.mesh, self.labels, self.boundaries)

    def save(self, path: str | Path) -> None:
        """Write the zones: `.vtp` (as by `to_pyvista`), `.json` (kinds, boundaries, nodes), `.stl` (one per zone).

        `part.stl` becomes `part_0.stl`, `part_1.stl` and so on.

        Raises
        ------
        ValueError
            For another extension.
        OSError
            When a file cannot be written; an older one is then as it was.
        """
        path = checks.path("path", path)
        suffix = path.suffix.lower()
        if suffix == ".stl":
            for k, patch in enumerate(self.patches()):
                patch.save(path.with_name(f"{path.stem}_{k}{path.suffix}"))
        elif suffix in (".vtp", ".json"):
            with draft(path) as place:
                if suffix == ".vtp":
                    self.to_pyvista().save(place)
                else:
                    place.write_text(json.dumps(self.as_dict(), indent=1))
        else:
            raise ValueError(f"path must end in .vtp, .json or .stl, not {path.name!r}")


def _most_inside(rows: Indices, inside: Mask) -> Indices:
    """Return the rows that are inside a zone if they are enough, else all."""
    inner = rows[inside[rows]]
    return inner if len(inner) >= LEAST_INNER else rows


def zoned(network: FeatureNetwork, parts: Indices) -> Zones:
    """Return the zones of labels (t,) of the parts between lines, the largest first."""
    found = network._found
    labels = sided(parts, found, network._centered)
    rank = edits.by_size(labels, found.edges.facets.areas)
    return Zones(network, checks.frozen(rank[labels]), checks.frozen(rank[parts]))
