"""Handles: pairs of opposite holes are joined into a tunnel or a bridge (T4)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh._base.errors import TopologyError
from simplexmesh._base.units import common_unit
from simplexmesh._base.vectors import cross, dot, norm, normalized
from simplexmesh.mesh.operators.editable_mesh import EditableMesh
from simplexmesh.mesh.operators.results import Edited
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.targets.protocol import Target, check_target, target_gaps
from simplexmesh.motion.topology.holes import refusal

LEAST_ON_DATA = 0.5
"""Fraction of the tube between distant holes that must lie on the data for them to be joined."""


@dataclass(frozen=True, eq=False, repr=False)
class HandleProposal:
    """Two faces proposed for joining, and the decision.

    Attributes
    ----------
    faces : tuple of two int
        On the given mesh.
    centers : (2, 3) array of float
        Centroids of their vertices.
    radii : (2,) array of float
        Mean distance of their vertices from the centroid.
    distance : float
        Between the centers, in the unit of the mesh.
    angle : float
        Between their normals, in radians: 0 when they are opposite, pi when they are the same.
    on_data : float or None
        Fraction of the tube between them that lies on the data, 0 to 1; None without a target.
    accepted : bool
        Whether they were joined.
    reason : str
        Reason for refusal; empty if accepted.
    """

    faces: tuple[int, int]
    centers: Array
    radii: Array
    distance: float
    angle: float
    on_data: float | None = None
    accepted: bool = False
    reason: str = ""

    @property
    def difference(self) -> float:
        """Relative difference of the diameters, 0 to 1."""
        return 1.0 - float(self.radii.min() / max(self.radii.max(), np.finfo(float).tiny))

    def __repr__(self) -> str:
        what = "accepted" if self.accepted else f"refused: {self.reason}" if self.reason else "open"
        return f"HandleProposal(faces {self.faces[0]} and {self.faces[1]}, {what})"


@dataclass(frozen=True, eq=False, repr=False)
class Handled(Edited):
    """A mesh with handles added to it.

    Attributes
    ----------
    proposals : tuple of HandleProposal
        The pairs considered, closest first, each accepted or with a reason for refusal.
    """

    proposals: tuple[HandleProposal, ...]


def add_handles(
    mesh: SimplexMesh,
    target: Target | None = None,
    *,
    gap: float = 2.0,
    difference: float = 0.2,
    angle: float = float(np.radians(30.0)),
    pairs: Iterable[Sequence[int]] | None = None,
    accept: Callable[[HandleProposal], Any] | None = None,
) -> Handled:
    """Join pairs of opposite holes (T4); within one component, each raises the genus by one.

    Candidates are all pairs of holes with close centers, similar diameters and nearly parallel planes. They are joined
    in order of distance relative to radius, each hole at most once. With a target, distant holes are joined too if the
    tube between them lies on the data.

    Parameters
    ----------
    mesh : SimplexMesh
    target : Target, optional
        The data, to distinguish deep tunnels from unrelated holes.
    gap : float
        Maximum distance of the centers, in mean radii of the two holes.
    difference : float
        Maximum relative difference of the diameters.
    angle : float
        Maximum angle between the planes, in radians.
    pairs : iterable of pairs of int, optional
        The faces to join instead, holes or not; they are refused only where T4 is impossible.
    accept : callable, optional
        Called with each proposal that meets the conditions; returns True to accept, False or a reason to refuse.

    Returns
    -------
    Handled
        The mesh, with vertex and face maps, and the proposals.

    Raises
    ------
    ValueError, TypeError
        For a target without `gap`, thresholds out of range, faces out of range, or in two pairs.

    References
    ----------
    H. Delingette, thesis, 1994, section 5.4.2.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.sphere(8)
    >>> x, y, z = ball.vertices.T
    >>> c = ball.connectivity
    >>> caps = [[f for f in range(ball.n_faces) if (s * z[ball.faces[f]] > 0.7).all()] for s in (1, -1)]
    >>> holed = sm.open_holes(ball, zones=caps).mesh
    >>> out = sm.add_handles(holed, gap=3.0)
    >>> out.mesh.genus, out.mesh.n_holes, [proposal.accepted for proposal in out.proposals]
    (1, 0, [True])
    """
    checks.instance("mesh", mesh, SimplexMesh)
    if target is not None:
        check_target(target)
        common_unit("mesh and target", (mesh, target))
    if accept is not None and not callable(accept):
        raise TypeError(f"accept must be a function of a HandleProposal, not {type(accept).__name__}")
    limits = (
        checks.number("gap", gap, 0.0),
        checks.number("difference", difference, 0.0, 1.0),
        checks.angle("angle", angle),
    )
    if pairs is not None:
        proposals = [_measured(mesh, a, b, target) for a, b in given_pairs(mesh, pairs)]
    else:
        holes = np.flatnonzero(mesh.connectivity.face_is_hole).tolist()
        found = [_measured(mesh, a, b, target) for a, b in combinations(holes, 2)]
        proposals = [_with_refusal(proposal, *limits) for proposal in sorted(found, key=_relative_distance)]
    return _joined(mesh, proposals, accept)


def given_pairs(mesh: SimplexMesh, pairs: Iterable[Sequence[int]], name: str = "pairs") -> list[list[int]]:
    """Return the user's pairs of faces, checked."""
    try:
        listed = list(pairs)
    except TypeError:
        raise TypeError(f"{name} must be pairs of faces, not {type(pairs).__name__}") from None
    n = len(mesh.connectivity.face_sizes)
    out = [checks.indices(f"{name}[{k}]", pair, (2,), n).tolist() for k, pair in enumerate(listed)]
    seen: dict[int, int] = {}
    for k, pair in enumerate(out):
        for face in pair:
            if face in seen:
                where = "twice" if seen[face] == k else f"and in {name}[{seen[face]}]"
                raise ValueError(f"{name} must not share a face; face {face} is in {name}[{k}] {where}")
            seen[face] = k
    return out


def _relative_distance(proposal: HandleProposal) -> float:
    return proposal.distance / max(float(proposal.radii.mean()), np.finfo(float).tiny)


def face_frame(mesh: SimplexMesh, face: int) -> tuple[Array, Array, Array]:
    """Return the vertices of a face in order (k, 3), their centroid, and the unit normal of the face."""
    c = mesh.connectivity
    outline = mesh.vertices[c.face_vertices[c.face_offsets[face] : c.face_offsets[face + 1]]]
    center = outline.mean(axis=0)
    return outline, center, normalized(cross(outline - center, np.roll(outline, -1, axis=0) - center).sum(axis=0))


def _measured(mesh: SimplexMesh, a: int, b: int, target: Target | None) -> HandleProposal:
    """Return the proposal of a pair of faces, with its measurements."""
    frames = [face_frame(mesh, face) for face in (a, b)]
    centers = np.array([frame[1] for frame in frames])
    radii = np.array([norm(frame[0] - frame[1]).mean() for frame in frames])
    angle = float(np.arccos(np.clip(-dot(frames[0][2], frames[1][2]), -1.0, 1.0)))
    on_data = None if target is None else _on_data(target, frames[0], frames[1], float(radii.mean()))
    distance = float(norm(centers[1] - centers[0]))
    return HandleProposal((a, b), checks.frozen(centers), checks.frozen(radii), distance, angle, on_data)


def _on_data(target: Target, one: Any, other: Any, radius: float) -> float:
    """Return the fraction of the straight tube between two holes with data within half a radius along its normals."""
    (outline, center, normal), (far_outline, far_center, _) = one, other
    near = _resampled(outline)
    far = _resampled(far_outline)[::-1]
    shift = min(range(len(far)), key=lambda k: float(norm(np.roll(far, k, axis=0) - near).sum()))
    far = np.roll(far, shift, axis=0)
    # the normals of a tunnel point to its axis, those of a bridge away from it
    inward = -1.0 if dot(far_center - center, normal) < 0 else 1.0
    seen = []
    for part in (0.25, 0.5, 0.75):
        ring = (1 - part) * near + part * far
        along = far - near
        away = ring - ring.mean(axis=0)
        away = away - along * (dot(away, along) / np.maximum(dot(along, along), 1e-300))[:, None]
        seen.append(target_gaps(target, np.ascontiguousarray(ring), inward * normalized(away), 0.5 * radius))
    return float(np.isfinite(np.concatenate(seen)).mean())


def _resampled(line: Array, count: int = 32) -> Array:
    """Return points at equal steps along a closed line."""
    closed = np.concatenate([line, line[:1]])
    length = np.concatenate([[0.0], np.cumsum(norm(np.diff(closed, axis=0)))])
    places = np.linspace(0.0, length[-1], count, endpoint=False)
    return np.stack([np.interp(places, length, closed[:, k]) for k in range(3)], axis=1)


def _with_refusal(proposal: HandleProposal, gap: float, difference: float, angle: float) -> HandleProposal:
    """Return the proposal, refused with the first condition that it fails, if any."""
    far = _relative_distance(proposal)
    if far > gap and not (proposal.on_data is not None and proposal.on_data >= LEAST_ON_DATA):
        reason = f"centers are {far:.3g} mean radii apart"
        return replace(
            proposal, reason=reason if proposal.on_data is None else f"{reason}, and no data is between them"
        )
    if proposal.difference > difference:
        return replace(proposal, reason=f"diameters differ by {proposal.difference:.0%}".replace("%", " %"))
    if proposal.angle > angle:
        return replace(proposal, reason=f"planes {np.degrees(proposal.angle):.0f} degrees apart")
    return proposal


def _joined(
    mesh: SimplexMesh, proposals: Sequence[HandleProposal], accept: Callable[[HandleProposal], Any] | None
) -> Handled:
    """Join the pairs that are not refused, in order, and return the decisions."""
    edit = EditableMesh(mesh)
    partner: dict[int, int] = {}
    out = []
    for proposal in proposals:
        a, b = proposal.faces
        reason = proposal.reason
        if not reason and (taken := [face for face in (a, b) if face in partner]):
            reason = f"face {taken[0]} was joined to face {partner[taken[0]]}"
        if not reason and accept is not None:
            reason = refusal(accept(proposal))
        if not reason:
            try:
                edit.join(a, b)
                partner.update({a: b, b: a})
            except TopologyError as error:
                reason = str(error).partition(": ")[2] or str(error)
        out.append(replace(proposal, accepted=not reason, reason=reason))
    done = edit.result()
    return Handled(done.mesh, done.vertex_map, done.face_map, tuple(out))
