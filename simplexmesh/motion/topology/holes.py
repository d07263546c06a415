"""Holes where there is no data: zones of faces far from it are cut off along contours."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices, Mask
from simplexmesh._base.errors import TopologyError
from simplexmesh._base.units import common_unit
from simplexmesh.mesh.connectivity import Connectivity
from simplexmesh.mesh.contours import Contour
from simplexmesh.mesh.face_geometry import face_areas
from simplexmesh.mesh.operators.cut_join import restricted
from simplexmesh.mesh.operators.editable_mesh import EditableMesh
from simplexmesh.mesh.operators.results import Edited
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.model.state import mean_edge
from simplexmesh.motion.targets.protocol import Target, check_target, target_gaps
from simplexmesh.motion.topology.face_regions import cuttable, face_components, with_holes_beside, without_islands

ON_DATA = "outlines that can be cut along enclose more faces on data than without"


@dataclass(frozen=True, eq=False, repr=False)
class HoleProposal:
    """A zone of the mesh proposed for cutting off, and the decision.

    Attributes
    ----------
    faces : (m,) array of int
        The faces of the zone on the given mesh, without holes it contains.
    vertices : (k,) array of int
        Their vertices.
    contours : tuple of Contour
        Its outlines, longest first, the zone on their left; none if no valid ones exist.
    area : float
        Area of the faces, in squared units.
    mean_distance : float
        Mean distance of its vertices to data along their normals, however far; NaN if none has data along its normal.
    accepted : bool
        Whether the zone was cut off.
    reason : str
        Reason for refusal; empty if accepted.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.sphere(6)
    >>> cap = [f for f, corners in enumerate(ball.faces) if (ball.vertices[corners, 2] > 0.5).all()]
    >>> proposal = sm.open_holes(ball, zones=[cap]).proposals[0]
    >>> proposal.accepted, len(proposal.faces), len(proposal.contour)
    (True, 73, 56)
    """

    faces: Indices
    vertices: Indices
    contours: tuple[Contour, ...]
    area: float
    mean_distance: float
    accepted: bool = False
    reason: str = ""

    @property
    def contour(self) -> Contour | None:
        """The longest outline of the zone, None without any."""
        return self.contours[0] if self.contours else None

    def __repr__(self) -> str:
        what = "accepted" if self.accepted else f"refused: {self.reason}" if self.reason else "open"
        return f"HoleProposal({len(self.faces)} faces, area {self.area:.4g}, {what})"


@dataclass(frozen=True, eq=False, repr=False)
class Opened(Edited):
    """A mesh with holes opened in it.

    Attributes
    ----------
    proposals : tuple of HoleProposal
        The zones found or given, largest area first, each accepted or with a reason for refusal.
    """

    proposals: tuple[HoleProposal, ...]


def open_holes(
    mesh: SimplexMesh,
    target: Target | None = None,
    *,
    reach: float | None = None,
    fewest: int = 6,
    zones: Iterable[ArrayLike] | None = None,
    accept: Callable[[HoleProposal], Any] | None = None,
) -> Opened:
    """Cut off the zones of a mesh that are far from the data (T3), leaving holes.

    A zone is a connected set of faces whose vertices all lack data along their normals within `reach`. Next to a
    hole, it enlarges the hole. Its outline is adjusted by a few faces to make a contour that can be cut, and groups of
    fewer than `fewest` faces that it encloses are included; a zone that would take more faces with data than it has is
    refused.

    Parameters
    ----------
    mesh : SimplexMesh
    target : Target, optional
        The data; optional when `zones` are given.
    reach : float, optional
        How far data is looked for, in the mesh's unit. Default: twice the mean edge length.
    fewest : int
        Minimum number of faces of a zone; ignored with `zones`.
    zones : iterable of arrays of int or of bool, optional
        Zones to cut off instead: faces by index, or masks of all faces, holes included.
    accept : callable, optional
        Called with each proposal; returns True to accept, False or a reason to refuse.

    Returns
    -------
    Opened
        The mesh, with vertex and face maps, and the proposals.

    Raises
    ------
    ValueError, TypeError
        For a target without `gap`, neither target nor zones, faces out of range, holes or in two zones, or an invalid
        answer of `accept`.

    References
    ----------
    H. Delingette, thesis, 1994, section 5.4.1.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ball = sm.sphere(6)
    >>> half = sm.PointCloud(sm.sphere(20).vertices[sm.sphere(20).vertices[:, 2] > 0])
    >>> out = open_holes(ball, sm.targets.Points(half), reach=0.1)
    >>> out.mesh.n_holes, out.mesh.n_components, out.proposals[0].accepted
    (1, 1, True)
    """
    checks.instance("mesh", mesh, SimplexMesh)
    if target is None and zones is None:
        raise TypeError("open_holes needs a target or zones")
    if target is not None:
        check_target(target)
        common_unit("mesh and target", (mesh, target))
    if accept is not None and not callable(accept):
        raise TypeError(f"accept must be a function of a HoleProposal, not {type(accept).__name__}")
    fewest = checks.integer("fewest", fewest, 1)
    limit = 2 * mean_edge(mesh) if reach is None else checks.number("reach", reach, 0.0, open_low=True)
    if limit == 0.0:
        raise ValueError("mesh must have some size, but all its vertices are at one point")
    on_data = np.zeros(len(mesh.connectivity.face_sizes), bool)
    if zones is None:
        assert target is not None
        far = unseen(mesh, target, limit)
        found = zones_far(mesh, far)
        on_data = ~mesh.connectivity.face_is_hole
        on_data[mesh.connectivity.vertex_faces[far].ravel()] = False
    else:
        found, fewest = given_zones(mesh, zones), 1
    away = np.full(mesh.n_vertices, np.nan) if target is None else _distances(mesh, target)
    areas = face_areas(mesh.vertices, mesh.connectivity.face_vertices, mesh.connectivity.face_offsets)
    proposals = [_proposed(mesh, zone, away, areas, fewest, on_data) for zone in found]
    proposals.sort(key=lambda proposal: -proposal.area)
    decided = [_with_decision(proposal, accept) for proposal in proposals]
    return _opened(mesh, _cut_together(mesh.connectivity, decided, on_data))


def unseen(mesh: SimplexMesh, target: Target, reach: float) -> Mask:
    """Return the mask (n,) of vertices without data within a distance, along the normal or at all."""
    gaps = target_gaps(target, np.array(mesh.vertices), np.array(mesh.normals), reach)
    beyond = getattr(target, "beyond", None)
    lost = ~(np.abs(gaps) <= reach)
    return np.asarray(lost if beyond is None else lost | beyond(mesh.vertices, reach))


def zones_far(mesh: SimplexMesh, far: Mask) -> list[Mask]:
    """Return the connected sets of faces whose vertices are all far, as masks that include adjacent holes."""
    c = mesh.connectivity
    near = c.face_is_hole.copy()  # holes connect no faces: a narrow set beside one, which stays, leaves others free
    near[c.face[~far].ravel()] = True
    return [with_holes_beside(c, zone) for zone in face_components(c, ~near)]


def given_zones(mesh: SimplexMesh, zones: Iterable[ArrayLike], name: str = "zones") -> list[Mask]:
    """Return the connected components of the user's zones as masks that include adjacent holes, checked."""
    c = mesh.connectivity
    taken = np.zeros(len(c.face_sizes), bool)
    out: list[Mask] = []
    try:
        listed = list(zones)
    except TypeError:
        raise TypeError(f"{name} must be lists of faces, not {type(zones).__name__}") from None
    for k, faces in enumerate(listed):
        numbers = checks.selection(f"{name}[{k}]", faces, len(taken))
        if not len(numbers):
            raise ValueError(f"{name}[{k}] must hold at least one face")
        if (hole := c.face_is_hole[numbers]).any():
            raise ValueError(f"{name}[{k}] must be faces; {numbers[hole.argmax()]} is a hole")
        if (twice := taken[numbers]).any():
            raise ValueError(
                f"{name} must not overlap; face {numbers[twice.argmax()]} is in {name}[{k}] and in an earlier one"
            )
        taken[numbers] = True
        zone = np.zeros(len(taken), bool)
        zone[numbers] = True
        out += face_components(c, with_holes_beside(c, zone))
    return [zone for zone in out if (zone & ~c.face_is_hole).any()]


def _distances(mesh: SimplexMesh, target: Target) -> Array:
    """Return (n,) the distances to the data along the normals, at any distance."""
    return np.abs(target_gaps(target, np.array(mesh.vertices), np.array(mesh.normals), np.inf))


def _proposed(mesh: SimplexMesh, zone: Mask, away: Array, areas: Array, fewest: int, on_data: Mask) -> HoleProposal:
    """Return the proposal of a zone, with the contours to cut along or the reason why it cannot be cut off."""
    c = mesh.connectivity
    size = int(np.count_nonzero(zone & ~c.face_is_hole))
    reason = f"{size} faces, fewer than {fewest}" if size < fewest else ""
    lines: tuple[Contour, ...] = ()
    if not reason:
        zone = without_islands(c, zone, fewest)
        valid = cuttable(c, zone)
        if valid is None:
            reason = "it has no outline that can be cut along" if not zone.all() else "it is the whole mesh"
        elif np.count_nonzero(valid & ~zone & on_data) > size:
            reason = ON_DATA
        else:
            zone = valid
            found = Contour.of_faces(mesh, zone)
            lines = tuple(sorted(found, key=lambda line: -line.length))
    faces = np.flatnonzero(zone & ~c.face_is_hole)
    vertices = np.flatnonzero((zone & ~c.face_is_hole)[c.vertex_faces].any(axis=1))
    seen = away[vertices][np.isfinite(away[vertices])]
    mean = float(seen.mean()) if len(seen) else float("nan")
    area = float(areas[faces].sum())
    return HoleProposal(checks.frozen(faces), checks.frozen(vertices), lines, area, mean, reason=reason)


def _with_decision(proposal: HoleProposal, accept: Callable[[HoleProposal], Any] | None) -> HoleProposal:
    if proposal.reason:
        return proposal
    reason = "" if accept is None else refusal(accept(proposal))
    return replace(proposal, accepted=not reason, reason=reason)


def refusal(answer: Any) -> str:
    """Return the reason for refusal from the answer of the user's function; empty if accepted."""
    if not isinstance(answer, bool | np.bool_ | str):
        raise TypeError(f"accept must return True, False or a text with the reason, not {type(answer).__name__}")
    if isinstance(answer, str):
        return answer or "refused by accept"
    return "" if answer else "refused by accept"


def _cut_together(c: Connectivity, proposals: Sequence[HoleProposal], on_data: Mask) -> list[HoleProposal]:
    """Refuse accepted zones that cannot be cut off with the larger ones unless more faces on data go as well."""
    gone, out = np.zeros(len(on_data), bool), []
    for proposal in proposals:
        if proposal.accepted:
            both = gone.copy()
            both[proposal.faces] = True
            off = cuttable(c, both)
            if off is not None and np.count_nonzero(off & ~both & on_data) > len(proposal.faces):
                proposal = replace(proposal, accepted=False, reason=ON_DATA)
            else:
                gone = both
        out.append(proposal)
    return out


def _opened(mesh: SimplexMesh, proposals: Sequence[HoleProposal]) -> Opened:
    """Cut along the contours of all accepted zones together, and discard what is cut off."""
    c = mesh.connectivity
    gone = np.zeros(len(c.face_sizes), bool)
    for proposal in proposals:
        if proposal.accepted:
            gone[proposal.faces] = True
    if not gone.any():
        unchanged = Edited(mesh, *(checks.frozen(np.arange(n, dtype=np.int32)) for n in (mesh.n_vertices, len(gone))))
        return Opened(unchanged.mesh, unchanged.vertex_map, unchanged.face_map, tuple(proposals))
    off = cuttable(c, gone)
    if off is None:
        raise TopologyError("the accepted zones leave nothing of the mesh; accept fewer of them")
    edit = EditableMesh(mesh)
    for line in Contour.of_faces(mesh, off):
        edit.cut(line.darts, holes=True)
    after = edit.result()
    parts = after.mesh.connectivity
    lost = parts.components[parts.face_vertices[parts.face_offsets[after.face_map[off]]]]
    kept = restricted(after.mesh, ~np.isin(parts.components, lost))
    return Opened(kept.mesh, kept.vertex_map, checks.frozen(kept.face_map[after.face_map]), tuple(proposals))
