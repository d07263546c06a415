"""What lines and circles have in common: they have a length, and no area."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh.data.primitives.base import Primitive
from simplexmesh.data.primitives.patch import STEPS
from simplexmesh.data.triangles import TriangleMesh

if TYPE_CHECKING:
    import pyvista as pv


class Curve(Primitive):
    """A primitive of one dimension: points have two distances from it, and one surface coordinate counts."""

    per_point: ClassVar[int] = 2

    def triangulated(self, edge: float | None = None) -> TriangleMesh:
        """Raise a ValueError: a curve has no area."""
        raise ValueError(f"a {self.kind} is a curve, and has no triangles: to_pyvista draws it")

    def to_pyvista(self) -> pv.PolyData:
        """Return the part within the extent as a polyline of PyVista's."""
        import pyvista as pv

        share = np.linspace(0, 1, STEPS + 1)[:, None]
        low, high = self._ends().T
        return pv.lines_from_points(self.at(low + share * (high - low)))

    def _area_density(self, uv: Array) -> Array:
        return np.ones(len(uv))


def eased(square: Array, weights: Array | None, loss_scale: float | None) -> tuple[Array, float]:
    """Return the weights (n,) of squared distances under the loss of a scale, if there is one, and the cost."""
    given = np.ones(len(square)) if weights is None else weights
    less = np.ones(len(square)) if loss_scale is None else 1 / (1 + square / loss_scale**2)
    return given * less**2, float((given * less) @ square)
