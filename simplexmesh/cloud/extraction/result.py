"""Primitives found in a cloud: labels of its points, files, pictures."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Indices
from simplexmesh._base.drafts import draft
from simplexmesh._base.html import card
from simplexmesh.cloud import step
from simplexmesh.cloud.fitting.selection import SURFACES
from simplexmesh.cloud.mesh_path import mesh_path
from simplexmesh.data.conversion import as_triangles
from simplexmesh.data.json_text import json_text
from simplexmesh.data.points import PointCloud
from simplexmesh.data.primitives import Primitive

if TYPE_CHECKING:
    import pyvista as pv


@dataclass(frozen=True, eq=False, repr=False)
class Extraction:
    """The primitives of a cloud, that of the most points first.

    Attributes
    ----------
    cloud : PointCloud
        The points.
    primitives : tuple of Primitive
        Each with its `fit`: `rms`, `covariance`, `extent`.
    labels : (n,) array of int
        The number of the primitive that each point of the cloud is of, -1 of none.
    noise : float
        Deviation of the points along normals, given or measured.
    bends : tuple of (int, int, int)
        Numbers of each torus that joins two cylinders, and of these: tangent to both and of their radius, exactly.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> ways = np.random.default_rng(0).normal(size=(3000, 3))
    >>> ball = sm.extract_primitives(ways / np.linalg.norm(ways, axis=1, keepdims=True))
    >>> ball, ball.labels.max()
    (Extraction(1 sphere in 3,000 points, 0 left over), np.int64(0))
    """

    cloud: PointCloud = field(repr=False)
    primitives: tuple[Primitive, ...]
    labels: Indices
    noise: float
    bends: tuple[tuple[int, int, int], ...] = ()

    def __repr__(self) -> str:
        return f"Extraction({self._summary()} in {len(self.cloud):,} points, {len(self.leftovers):,} left over)"

    def _repr_html_(self) -> str:
        """Return a picture of the primitives and a table of them, as notebooks show it."""
        rows = {f"{k}": f"{each}: {each.fit}" for k, each in enumerate(self.primitives)}
        rows["left over"] = f"{len(self.leftovers):,} of {len(self.cloud):,} points"
        return card(self._summary(), rows, *([self.to_pyvista()] if self.primitives else []))

    def _summary(self) -> str:
        counts = Counter(each.kind for each in self.primitives)
        plural = {kind: {"torus": "tori"}.get(kind, kind + "s") for kind in SURFACES}
        named = [f"{n} {kind if n == 1 else plural[kind]}" for kind in SURFACES if (n := counts[kind])]
        return ", ".join(named) or "no primitives"

    def __len__(self) -> int:
        return len(self.primitives)

    @property
    def leftovers(self) -> Indices:
        """The points (k,) of no primitive."""
        return np.flatnonzero(self.labels < 0)

    def points(self, number: int) -> Indices:
        """Return the points (k,) of a primitive.

        Parameters
        ----------
        number : int
            Its number among the primitives.
        """
        return np.flatnonzero(self.labels == checks.integer("number", number, 0, len(self.primitives) - 1))

    def as_dict(self) -> dict[str, Any]:
        """Return the primitives as plain lists and numbers, angles in radians: what the JSON file holds."""
        return {
            "noise": self.noise,
            "unit": self.cloud.unit,
            "primitives": [_plain(each) for each in self.primitives],
            "bends": [list(each) for each in self.bends],
            "labels": self.labels.tolist(),
        }

    def to_pyvista(self) -> pv.PolyData:
        """Return the parts of the primitives within their extents as PyVista's; cells have a "primitive" and a "kind".

        The latter is the number in the array "kinds" of the data set.
        """
        import pyvista as pv

        parts = []
        for k, each in enumerate(self.primitives):
            part = each.to_pyvista()
            part.cell_data["primitive"] = np.full(part.n_cells, k)
            part.cell_data["kind"] = np.full(part.n_cells, SURFACES.index(each.kind))
            parts.append(part)
        out = pv.merge(parts, merge_points=False) if parts else pv.PolyData()
        out.field_data["kinds"] = np.array(SURFACES)
        return out

    def save(self, path: str | Path) -> None:
        """Write the primitives: parameters, fits and labels as .json, meshes as .vtp, exact surfaces as .step or .stp.

        STEP files need the extra `step`. They are in the cloud's unit, or say mm if that is not known. Other files of
        meshes, as .ply or .glb, have the triangles alone.

        Raises
        ------
        ValueError
            For another extension, and for STEP files without primitives.
        ImportError
            Without the extra; the message says how to install it.
        OSError
            When a file cannot be written; an older one is then as it was.

        Warns
        -----
        SimplexMeshWarning
            A STEP file of a cloud whose unit is not known.
        """
        path = checks.path("path", path)
        suffix = path.suffix.lower()
        own = (".json", ".vtp", *step.ENDINGS)
        if suffix not in own:
            mesh_path(path, own)
            if not self.primitives:
                raise ValueError("no primitives were found whose meshes could be saved")
            replace(as_triangles(self.to_pyvista()), unit=self.cloud.unit).save(path)
            return
        with draft(path) as place:
            if suffix == ".vtp":
                self.to_pyvista().save(place)
            elif suffix == ".json":
                place.write_text(json_text(self.as_dict()) + "\n", encoding="utf-8")
            else:
                named = [(f"{each.kind} {k}", each) for k, each in enumerate(self.primitives)]
                place.write_bytes(step.step_file({"primitives": named}, self.cloud.unit, solid=False))


def _plain(primitive: Primitive) -> dict[str, Any]:
    """Return a primitive and its fit as plain lists and numbers."""
    out = primitive.as_dict()
    fit = primitive.fit
    if fit is not None:
        out["fit"] = {
            "rms": fit.rms,
            "count": fit.count,
            "extent": fit.extent.tolist(),
            "across": primitive.frame[0].tolist(),
            "parameters": list(primitive.parameter_names),
            "covariance": fit.covariance.tolist() if np.isfinite(fit.covariance).all() else None,
        }
    return out
