"""The union of several targets: the nearest one counts."""

from __future__ import annotations

from typing import Any

import numpy as np

from simplexmesh._base.arrays import Array
from simplexmesh._base.units import common_unit
from simplexmesh.motion.targets.protocol import BuiltInTarget, check_target, checked_arguments, target_gaps


class Union(BuiltInTarget):
    """The closest of several targets, per vertex.

    Parameters
    ----------
    targets : sequence of targets
        At least one; each has a method `gap(vertices, normals, reach)`.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> floor = sm.TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> shelf = sm.TriangleMesh(floor.vertices + [0, 0, 1], floor.faces)
    >>> both = Union([sm.targets.Triangles(floor), sm.targets.Triangles(shelf)])
    >>> up = np.array([[0.0, 0.0, 1.0]] * 2)
    >>> both.gap(np.array([[0.5, 0.2, 0.1], [0.5, 0.2, 0.8]]), up, reach=2.0).round(3)
    array([-0.1,  0.2])
    """

    def __init__(self, targets: Any) -> None:
        try:
            self.targets = tuple(targets)
        except TypeError:
            raise TypeError(f"targets must be a sequence of targets, not {type(targets).__name__}") from None
        if not self.targets:
            raise ValueError("targets must be at least one, not none")
        for k, target in enumerate(self.targets):
            check_target(target, f"targets[{k}]")
        self.unit = common_unit("targets", self.targets)

    @property
    def bounds(self) -> Array | None:
        """(2, 3) array of float: lowest and highest coordinates of all targets; None where one has none."""
        each = [getattr(target, "bounds", None) for target in self.targets]
        known = [bounds for bounds in each if bounds is not None]
        if len(known) < len(each):
            return None
        return np.stack([np.min([b[0] for b in known], axis=0), np.max([b[1] for b in known], axis=0)])

    def gap(self, vertices: Array, normals: Array, reach: float) -> Array:
        """Return (n,) the gap of smallest magnitude among the targets, NaN where none has data within `reach`."""
        vertices, normals, reach = checked_arguments(vertices, normals, reach)
        each = [target_gaps(target, vertices, normals, reach, f"targets[{k}]") for k, target in enumerate(self.targets)]
        gaps = np.stack(each)
        sizes = np.where(np.isnan(gaps), np.inf, np.abs(gaps))
        return np.take_along_axis(gaps, sizes.argmin(axis=0)[None], axis=0)[0]
