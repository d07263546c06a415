"""What may change of a mesh's topology on its way to the data, and what did."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from simplexmesh import _check
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.handles import HandleProposal
from simplexmesh.motion.holes import HoleProposal
from simplexmesh.motion.refine import THRESHOLDS

FIRST = 0.42
"""The share of the vertices that a start has when refinement spends the others: 720 of 1,700, as in the thesis."""

ENOUGH = 720
"""A start of fewer is too coarse to find holes; it gets up to eight tenths of the vertices."""

Choice = str | Sequence[Any] | Callable[[Any], bool]


@dataclass(frozen=True)
class Plan:
    """What may change on the way.

    Attributes
    ----------
    holes, handles : {"auto", "none"}, function or sequence
        Which proposals are accepted; a sequence gives the zones, or the pairs of faces.
    refine : {"none", "auto", "coarse", "medium", "fine"}
        How fine faces become; "auto" uses all vertices up to `vertices`.
    vertices : int
        The most there may be.
    placement : {"even", "adaptive", "closed"}
        Whether faces are divided and merged for each other where the data asks for it; "closed" while there is no hole:
        between coarser faces rims lose their way.
    """

    holes: Choice = "none"
    handles: Choice = "none"
    refine: str = "none"
    vertices: int = 0
    placement: str = "even"

    @property
    def first_vertices(self) -> int:
        """How many the start should have: refinement adds the others."""
        if self.refine == "none":
            return self.vertices
        return max(int(FIRST * self.vertices), min(int(0.8 * self.vertices), ENOUGH))

    def exchanges(self, mesh: SimplexMesh) -> bool:
        """Whether faces of this mesh are to be exchanged."""
        return self.placement == "adaptive" or (self.placement == "closed" and not mesh.n_holes)

    @property
    def changes(self) -> bool:
        """Whether anything may."""
        return not (self.holes == "none" and self.handles == "none" and self.refine == "none")


@dataclass(frozen=True)
class TopologyRecord:
    """What was changed of a mesh's topology while it moved.

    Attributes
    ----------
    holes : tuple of HoleProposal
        The zones far from the data, each cut off or with the reason why not.
    handles : tuple
        The pairs of faces considered for a handle, likewise.
    refined : int
        Vertices that refinement added.
    exchanged : int
        Pairs of faces that were merged so that other faces could be divided.
    swapped : int
        Edges swapped to even out the sizes of faces, by all of these; wrapping, which does so all the time, left out.
    exceptions : tuple of int
        The faces of the final mesh, holes left out, that have fewer than five or more than seven vertices still.
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
    """Return what may change, checked, by default all for primitives, the placement for starts found, else nothing.

    Raises
    ------
    ValueError, TypeError
        For a word that is none of those known, or anything but words, functions and sequences.

    Examples
    --------
    >>> plan_for("sphere", 1000, None, None, None).refine, plan_for("auto", 1000, None, None, None).changes
    ('auto', False)
    """
    usual = "none" if init in (None, "auto") else "auto"
    for name, given in (("holes", holes), ("handles", handles)):
        if isinstance(given, str):
            _check.choice(name, given, ("auto", "none"))
        elif given is not None and not callable(given) and not hasattr(given, "__len__"):
            raise TypeError(f"{name} must be a word, a function or a sequence, not {type(given).__name__}")
    if refine is not None:
        _check.choice("refine", refine, ("none", "auto", *THRESHOLDS))
    if placement is not None:
        _check.choice("placement", placement, ("adaptive", "even"))
    return Plan(
        usual if holes is None else holes,
        usual if handles is None else handles,
        refine or usual,
        vertices,
        placement or ("even" if init is None else "closed"),
    )
