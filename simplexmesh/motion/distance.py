"""Summaries of distances between a mesh and its data."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Summary:
    """Mean, root mean square, 95th percentile, maximum and number of a set of distances.

    Examples
    --------
    >>> Summary.of(np.array([0.0, 3.0, 4.0, np.nan]))
    Summary(mean=2.333, rms=2.887, p95=3.9, max=4, count=3)
    """

    mean: float
    rms: float
    p95: float
    max: float
    count: int

    @classmethod
    def of(cls, distances: Array) -> Summary:
        """Return the summary of the absolute values of the finite ones of (n,) distances; NaN without any."""
        known = np.abs(distances[np.isfinite(distances)])
        if not len(known):
            return cls(float("nan"), float("nan"), float("nan"), float("nan"), 0)
        return cls(
            float(known.mean()),
            float(np.sqrt((known**2).mean())),
            float(np.percentile(known, 95)),
            float(known.max()),
            len(known),
        )

    def __repr__(self) -> str:
        numbers = ", ".join(f"{name}={getattr(self, name):.4g}" for name in ("mean", "rms", "p95", "max"))
        return f"Summary({numbers}, count={self.count})"


@dataclass(frozen=True)
class Distance:
    """Distances between a mesh and its data, both ways, in the data's unit.

    Attributes
    ----------
    mesh_to_data : Summary
        From the vertices of the mesh to the surface in the data along their normals, or to the nearest point of the
        data where there is none within reach.
    data_to_mesh : Summary
        From the points of the data to the surface of the mesh (its fan triangulation). Of a volume, these are the
        points reached from the background.
    enclosed : Summary
        The part of `data_to_mesh` inside the model and far from its surface: walls of cavities that the model closes
        over, such as airways behind sealed nostrils.
    """

    mesh_to_data: Summary
    data_to_mesh: Summary
    enclosed: Summary

    def as_dict(self) -> dict[str, dict[str, float]]:
        """Return plain numbers, ready for JSON."""
        return asdict(self)
