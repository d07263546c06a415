"""What `refine` and `redistribute` share: checked options, a refinement in progress, and its result."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Mask
from simplexmesh._base.errors import counted, warn
from simplexmesh._base.units import common_unit
from simplexmesh.mesh.operators.results import Edited
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.density.face_edits import Maps, composed_maps, mapped_zone
from simplexmesh.motion.model.deform import DeformableModel
from simplexmesh.motion.model.parameters import MOST_RIGID
from simplexmesh.motion.model.untangle import Tangles, untangled, with_membrane
from simplexmesh.motion.reconstruct.conversion import as_input
from simplexmesh.motion.targets.protocol import Target, checked_reach
from simplexmesh.motion.topology.face_regions import dilated

THRESHOLDS = {"coarse": 2e-4, "medium": 2.5e-5, "fine": 3e-6}
"""Score thresholds by name. On a smooth surface the score of a face falls with the cube of the number of faces, so each
eighth of a threshold about doubles the number of vertices."""


def default_reach(mesh: SimplexMesh, reach: float | None) -> float:
    """Return the reach given, checked, or by default 10 % of the mesh's diagonal."""
    if reach is not None:
        return checked_reach(reach)
    diagonal = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
    if diagonal == 0.0:
        raise ValueError("mesh must have some size, but all its vertices are at one point")
    return 0.1 * diagonal


def threshold_of(threshold: str | float) -> float:
    """Return the score threshold of a name, or the number given, checked to be above 0."""
    if isinstance(threshold, str):
        return THRESHOLDS[checks.choice("threshold", threshold, tuple(THRESHOLDS))]
    return checks.number("threshold", threshold, 0.0, open_low=True)


def zone_of(mesh: SimplexMesh, zones: ArrayLike) -> Mask:
    """Return the mask (f,) of the faces that refinement is limited to."""
    c = mesh.connectivity
    given = checks.any_array("zones", zones)
    if given.dtype == bool:
        if given.shape == (c.n_vertices,):
            return np.logical_and.reduceat(given[c.face_vertices], c.face_offsets[:-1])
        if given.shape == (c.face_sizes.size,):
            return given.copy()
        raise ValueError(
            f"zones must be a mask of the {c.face_sizes.size} faces or of the {c.n_vertices} vertices, "
            f"not one of shape {given.shape}"
        )
    out = np.zeros(c.face_sizes.size, bool)
    out[checks.indices("zones", zones, (None,), out.size)] = True
    return out


def as_target(target: Any, *, level: float | None, label: int | None, inside: str = "above") -> Target:
    """Return a target unchanged, and the target made from data of any kind that `reconstruct` accepts."""
    if callable(getattr(target, "gap", None)):
        if level is not None or label is not None or inside != "above":
            raise ValueError(f"level, label and inside are for volumes, not for {type(target).__name__}")
        return target
    try:
        return as_input(target, level=level, label=label, inside=inside).target
    except TypeError as error:
        raise TypeError(f"target must have a method gap(vertices, normals, reach) or be data; {error}") from error


@dataclass(frozen=True)
class Round:
    """One round of refinement.

    Attributes
    ----------
    above : int
        Number of faces with a score above the threshold, before the round.
    highest : float
        The highest score, before the round.
    cut : int
        Number of faces divided in two (T2).
    n_vertices : int
        Number of vertices after the round.
    merged : int
        Number of pairs of faces merged (T1), by `redistribute` only.
    swapped : int
        Number of edges swapped (T7) to even out face sizes.
    """

    above: int
    highest: float
    cut: int
    n_vertices: int
    merged: int = 0
    swapped: int = 0


@dataclass(frozen=True, eq=False)
class Refined(Edited):
    """A refined mesh, with vertex and face maps and the record of the rounds.

    Attributes
    ----------
    rounds : tuple of Round
        One per round.
    converged : bool
        Whether no face that may be divided scored above the threshold at the last evaluation; of `redistribute`,
        whether the number of vertices is within 1 % of that requested.
    interrupted : bool
        Whether the refinement was interrupted (Ctrl-C); `mesh` is then the last complete state.
    tangled : int or None
        Number of vertices on faces that are folded or cross others at the end, with a warning if there are any; None
        when that was not tested, as nothing changed or the refinement was interrupted.
    """

    rounds: tuple[Round, ...] = ()
    converged: bool = False
    interrupted: bool = False
    tangled: int | None = None

    @property
    def inserted(self) -> int:
        """Number of vertices added; negative when some were removed."""
        return self.mesh.n_vertices - int(self.vertex_map.size)

    def __repr__(self) -> str:
        end = "interrupted" if self.interrupted else "converged" if self.converged else "not converged"
        change = f"{abs(self.inserted)} vertices {'added' if self.inserted >= 0 else 'removed'}"
        return f"Refined({self.mesh!r}, {change} in {len(self.rounds)} rounds, {end})"


@dataclass
class Refinement:
    """A refinement in progress; an interrupt during the motion of a round leaves the state before it."""

    mesh: SimplexMesh
    target: Target
    reach: float
    iterations: int
    adaptation: float
    rigidity: int
    zone: Mask | None = None
    watch: Callable[[Round, SimplexMesh], None] | None = None

    def __post_init__(self) -> None:
        common_unit("mesh and target", (self.mesh, self.target))
        checks.integer("iterations", self.iterations, 0)
        checks.number("adaptation", self.adaptation, 0.0, 0.25)
        checks.integer("rigidity", self.rigidity, 0, MOST_RIGID)
        if self.watch is not None and not callable(self.watch):
            raise TypeError(f"watch must be a function of a Round and the mesh, not {type(self.watch).__name__}")
        self.rounds: list[Round] = []
        self.converged = self.interrupted = False
        self.tangled: int | None = None
        c = self.mesh.connectivity
        self.maps: Maps = np.arange(c.n_vertices, dtype=np.int32), np.arange(c.face_sizes.size, dtype=np.int32)

    @contextmanager
    def interruptible(self) -> Iterator[None]:
        """End with the last complete state, and a warning, when interrupted (Ctrl-C)."""
        try:
            yield
        except KeyboardInterrupt:
            self.interrupted = True
            done = counted(len(self.rounds), "round", "rounds")
            warn(f"interrupted after {done}; the mesh is the last complete state")

    def apply(self, step: Refined) -> None:
        """Move the mesh of one round of edits and make it the present one."""
        zone = None if self.zone is None else mapped_zone(self.zone, step)
        mesh = self._moved(step.mesh, zone, self.iterations, attempts=3)
        self.mesh, self.zone, self.maps = mesh, zone, composed_maps(self.maps, step)
        self.rounds += step.rounds
        if self.watch is not None:
            self.watch(self.rounds[-1], mesh)

    def finish(self) -> None:
        """Move the mesh for the last time: longer, with more attempts at untangling."""
        self.mesh = self._moved(self.mesh, self.zone, max(self.iterations, 40), attempts=10)
        tangles = Tangles(self.mesh)
        for rings in (1, 2, 4) if tangles.count and self.zone is None else ():
            marked = dilated(tangles.vertices, tangles.mesh.neighbors, rings)
            tangles = tangles.improved(with_membrane(tangles.mesh, marked), marked)
        self.mesh, tangled = tangles.mesh, tangles.count
        if tangled:
            warn(f"{counted(tangled, 'vertex is', 'vertices are')} on faces that are folded or cross others")
        self.tangled = tangled

    def _moved(self, mesh: SimplexMesh, zone: Mask | None, iterations: int, *, attempts: int) -> SimplexMesh:
        """Return the mesh after motion, and untangling unless there is a zone of faces, outside which nothing moves."""
        if not self.iterations:
            return mesh
        free = 0.4 if zone is None else 0.4 * zone[mesh.connectivity.vertex_faces].any(axis=1)
        model = DeformableModel(
            mesh, self.target, rigidity=self.rigidity, reach=self.reach, alpha=free, beta=free,
            adaptation=self.adaptation,
        )  # fmt: skip
        for _ in model.run(iterations, warnings=False):
            pass
        if zone is not None:
            return model.mesh
        return untangled(Tangles(model.mesh), self.target, reach=self.reach, rounds=attempts).mesh

    def result(self) -> Refined:
        """Return the result record."""
        maps = checks.frozen(self.maps[0]), checks.frozen(self.maps[1])
        return Refined(self.mesh, *maps, tuple(self.rounds), self.converged, self.interrupted, self.tangled)
