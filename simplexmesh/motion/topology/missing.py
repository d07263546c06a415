"""What a closed model lacks of the topology of its data: messages of warnings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from simplexmesh._base.vectors import norm
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.model.stages import mean_edge
from simplexmesh.motion.model.state import Target
from simplexmesh.motion.topology.handles import HandleProposal

CLEARLY_OPEN = 0.2
"""Width of the border of data, in its diagonals, from which a model without holes is warned of."""


def genus_message(surface: SimplexMesh, mesh: SimplexMesh, proposals: Sequence[HandleProposal]) -> str:
    """Return a message about a model that lacks handles of a surface near its data; empty if the user refused any."""
    if mesh.genus == surface.genus or any(not proposal.accepted for proposal in proposals):
        return ""
    return f"the data has genus {surface.genus}, the model has {mesh.genus}; init='auto' finds all its handles"


def open_data_message(target: Target, points: NDArray[np.float64], mesh: SimplexMesh) -> str:
    """Return a message about a model without holes of points whose target has a wide border, else an empty one."""
    if mesh.n_holes or border_width(target, points) < CLEARLY_OPEN:
        return ""
    return (
        "the data ends along a wide border, but the model is closed: no zone off the data was found to open "
        f"(edges of {mean_edge(mesh):.3g}); more vertices or init='plane' may"
    )


def border_width(target: Target, points: NDArray[np.float64]) -> float:
    """Return the width of the widest border of the data, in diagonals of its points; 0 without any."""
    border = getattr(target, "border", None)
    return 0.0 if border is None else float(border.width.max(initial=0.0) / norm(np.ptp(points, axis=0)))
