"""What point clouds and triangle meshes have in common: places with named arrays, which are saved and handed on."""

from __future__ import annotations

import math
import os
from dataclasses import replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh._base.named_arrays import Data, changed
from simplexmesh._base.units import InUnits

Self = TypeVar("Self", bound="Located")


class Located(InUnits):
    """Places in space with named arrays.

    Attributes
    ----------
    data : mapping of str to array
        One row for each place.
    """

    data: Data

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(checks.frozen_state(state))

    def __getstate__(self) -> dict[str, Any]:
        return checks.picklable_state(self.__dict__)

    @cached_property
    def bounds(self) -> Array:
        """(2, 3) array of float: lowest and highest coordinates."""
        at = self.points if hasattr(self, "points") else self.vertices  # type: ignore[attr-defined]
        return checks.frozen(np.stack([at.min(axis=0), at.max(axis=0)]))

    @property
    def diagonal(self) -> float:
        """Length of the diagonal of the bounding box."""
        return math.dist(*self.bounds)

    def with_data(self: Self, **arrays: ArrayLike | None) -> Self:
        """Return the same with named arrays added or replaced, one row for each place; None removes one.

        Examples
        --------
        >>> import numpy as np, simplexmesh as sm
        >>> list(sm.PointCloud(np.eye(4)[:, :3]).with_data(intensity=[1, 2, 3, 4]).data)
        ['intensity']
        """
        return replace(self, data=changed(self.data, arrays))  # type: ignore[type-var]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write to a file in the format its name says.

        Points: .vtp, .ply or .xyz. Triangles also: .obj, .off, .stl, and .glb or .3mf with the extra `export`. All
        arrays go into .vtp and .ply, those of up to four columns into .glb, colors and `uv` into .obj.

        Warns
        -----
        SimplexMeshWarning
            Arrays that the format does not hold; the message names them.
        """
        from simplexmesh.data.io import writing

        writing.save(path, self)

    def to_pyvista(self) -> Any:
        """Return a `pyvista.PolyData` with the data, of points with their normals."""
        from simplexmesh.data.io import writing

        return writing.to_pyvista(self)

    def to_trimesh(self) -> Any:
        """Return a `trimesh.Trimesh` with colors and other arrays, of points a `trimesh.PointCloud` with colors only.

        Needs the extra `export`.
        """
        from simplexmesh.data import exporting

        return exporting.to_trimesh(self)

    def to_open3d(self) -> Any:
        """Return an `open3d.t.geometry` PointCloud or TriangleMesh with normals, colors and other arrays.

        Needs Open3D.
        """
        from simplexmesh.data import exporting

        return exporting.to_open3d(self)
