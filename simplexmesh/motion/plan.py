"""The changes of topology and connectivity that a reconstruction may make, and the record of those made."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from simplexmesh import _check
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.handles import HandleProposal
from simplexmesh.motion.holes import HoleProposal
from simplexmesh.motion.refine import THRESHOLDS

START_SHARE = 0.42
"""Fraction of the vertices in the start when refinement adds the others: 720 of 1,700, as in the thesis."""

FEWEST_START = 720
"""A start of fewer vertices is too coarse to find holes; it gets up to eight tenths of all."""

Choice = str | Sequence[Any] | Callable[[Any], bool]


@dataclass(frozen=True)
class Plan:
    """The changes of a mesh that a reconstruction may make.

    Attributes
    ----------
    holes, handles : {"auto", "none"}, function or sequence
        Which proposals are accepted; a sequence gives the zones or the pairs of faces instead.
    refine : {"none", "auto", "coarse", "medium", "fine"}
        The threshold of refinement; "auto" uses all of `vertices`.
    vertices : int
        Maximum number.
    placement : {"even", "adaptive", "closed"}
        Whether vertices are redistributed by curvature and distance to the data; "closed" does so only without holes:
        among coarse faces, rims stray.
    """

    holes: Choice = "none"
    handles: Choice = "none"
    refine: str = "none"
    vertices: int = 0
    placement: str = "even"

    @property
    def first_vertices(self) -> int:
        """Number of vertices of the start; refinement adds the others."""
        if self.refine == "none":
            return self.vertices
        return max(int(START_SHARE * self.vertices), min(int(0.8 * self.vertices), FEWEST_START))

    def exchanges(self, mesh: SimplexMesh) -> bool:
        """Return whether vertices of this mesh are to be redistributed."""
        return self.placement == "adaptive" or (self.placement == "closed" and not mesh.n_holes)

    @property
    def changes(self) -> bool:
        """Whether holes, handles or refinement are planned."""
        return not (self.holes == "none" and self.handles == "none" and self.refine == "none")


@dataclass(frozen=True)
class TopologyRecord:
    """The changes of topology and connectivity made by a reconstruction.

    Attributes
    ----------
    holes : tuple of HoleProposal
        The zones far from the data, each cut off or with the reason for refusal.
    handles : tuple of HandleProposal
        The pairs of faces considered for a handle, likewise.
    refined : int
        Number of vertices added by refinement.
    exchanged : int
        Number of pairs of faces merged in exchange for divisions of other faces.
    swapped : int
        Number of edges swapped to even out face sizes, except while wrapping.
    exceptions : tuple of int
        The faces of the final mesh, without holes, that have fewer than five or more than seven vertices.
    """

    holes: tuple[HoleProposal, ...] = ()
    handles: tuple[HandleProposal, ...] = ()
    refined: int = 0
    exchanged: int = 0
    swapped: int = 0
    exceptions: tuple[int, ...] = ()


def plan_for(
    init: str | None,
    vertices: int,
    holes: Choice | None,
    handles: Choice | None,
    refine: str | None,
    placement: str | None = None,
) -> Plan:
    """Return the checked plan: by default all for primitives, only placement for automatic starts, nothing for meshes.

    Raises
    ------
    ValueError, TypeError
        For an unknown name, or a value that is neither name, function nor sequence.

    Examples
    --------
    >>> plan_for("sphere", 1000, None, None, None).refine, plan_for("auto", 1000, None, None, None).changes
    ('auto', False)
    """
    default = "none" if init in (None, "auto") else "auto"
    choices = _choice("holes", holes, default), _choice("handles", handles, default)
    if refine is not None:
        _check.choice("refine", refine, ("none", "auto", *THRESHOLDS))
    if placement is not None:
        _check.choice("placement", placement, ("adaptive", "even"))
    return Plan(
        *choices,
        refine or default,
        vertices,
        placement or ("even" if init is None else "closed"),
    )


def _choice(name: str, given: Choice | None, default: str) -> Choice:
    """Return the choice of holes or handles, checked; sequences as lists, since arrays do not compare with names."""
    if given is None:
        return default
    if isinstance(given, str):
        return _check.choice(name, given, ("auto", "none"))
    if callable(given):
        return given
    if not hasattr(given, "__len__"):
        raise TypeError(f"{name} must be 'auto', 'none', a function or a sequence, not {type(given).__name__}")
    return list(given)
