"""Topology of the data that a model lacks, for warnings: tunnels with place, girth and reason, and open borders."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from simplexmesh import _check
from simplexmesh._vec import norm
from simplexmesh.mesh.loops import Loop
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.evolve import mean_edge
from simplexmesh.motion.handles import HandleProposal
from simplexmesh.motion.subjects import Subject
from simplexmesh.motion.tunnel_homology import TunnelHomology, independent
from simplexmesh.motion.wrap import Samples

EDGES_AROUND = 9.0
"""Minimum number of edges around a tunnel for films to fit through it."""

MOST_LISTED = 4
"""Tunnels listed in a message; more are counted."""

FAR, ASTRAY = 1.5, 0.01
"""Distance, in edges, beyond which a vertex is off the data, and the fraction of such vertices for a warning."""

WIDE = 0.2
"""In diagonals of the data: data with a wider border is clearly open."""

REFUSED = "its films met, but were not joined: refused by accept"
"""Tunnels refused by the user without a reason are not reported."""


def missing_tunnels(
    homology: TunnelHomology, proposals: Sequence[HandleProposal], *, edge: float, vertices: int
) -> tuple[HandleProposal, ...]:
    """Return a refused proposal for each tunnel of a surface without an accepted handle, the narrowest first.

    Parameters
    ----------
    homology : TunnelHomology
        Of the surface.
    proposals : sequence of HandleProposal
        The proposals made; a tunnel refused there keeps its reason.
    edge : float
        The mean length of the model's edges.
    vertices : int
        Number of vertices of the model.

    Returns
    -------
    tuple of HandleProposal
        Faces are -1; both centers are that of the shortest loop around the tunnel, radii its girth / (2 pi).

    Examples
    --------
    >>> import simplexmesh as sm
    >>> donut = sm.torus(24, 12).triangulated()
    >>> homology = TunnelHomology(donut.vertices, donut.faces)
    >>> [proposal.reason for proposal in missing_tunnels(homology, (), edge=0.1, vertices=900)]
    ['its films did not meet']
    """
    known = [x.winding for x in proposals if x.accepted and x.winding is not None]
    refused = [x for x in proposals if not x.accepted]
    out = []
    for loop in reversed(homology.tunnels):
        winding = homology.winding_of_path(loop.vertices)
        if not independent(known, winding):
            continue
        known.append(winding)
        centers = _check.frozen(np.stack([loop.center, loop.center]))
        radii = _check.frozen(np.full(2, loop.length / (2 * np.pi)))
        out.append(HandleProposal((-1, -1), centers, radii, 0.0, 0.0, reason=_reason(loop, edge, vertices, refused)))
    return tuple(out[::-1])


def _reason(loop: Loop, edge: float, n: int, refused: Sequence[HandleProposal]) -> str:
    around = loop.length / edge
    if around < EDGES_AROUND:
        needed = n * (EDGES_AROUND / around) ** 2
        digits = 10 ** max(int(np.log10(needed)) - 1, 0)
        return (
            f"its girth of {loop.length:.3g} is {around:.2g} edges of the model; "
            f"about {round(needed / digits) * digits:,} vertices would fit through"
        )
    for proposal in refused:
        reach = proposal.radii.max() + proposal.distance
        if proposal.faces[0] >= 0 and norm(proposal.centers.mean(axis=0) - loop.center) < reach:
            return f"its films met, but were not joined: {proposal.reason}"
    return "its films did not meet"


def tunnel_list(proposals: Sequence[HandleProposal]) -> str:
    """Return a clause that lists missing tunnels.

    Examples
    --------
    >>> loop = np.zeros((2, 3)), np.array([0.5, 0.5])
    >>> tunnel_list([HandleProposal((-1, -1), *loop, 0.0, 0.0, reason="its films did not meet")])
    'left out: the tunnel of girth 3.14 at (0, 0, 0): its films did not meet'
    """
    clauses = []
    for proposal in proposals[:MOST_LISTED]:
        place = ", ".join(f"{x:.3g}" for x in (proposal.centers[0] + 0.0).tolist())
        clauses.append(f"the tunnel of girth {2 * np.pi * proposal.radii[0]:.3g} at ({place}): {proposal.reason}")
    if len(proposals) > MOST_LISTED:
        clauses.append(f"{len(proposals) - MOST_LISTED} more, in topology.handles")
    return "left out: " + "; ".join(clauses)


def with_missing_tunnels(
    samples: Samples, proposals: tuple[HandleProposal, ...], mesh: SimplexMesh
) -> tuple[tuple[HandleProposal, ...], str]:
    """Return the proposals with those of missing tunnels added, and a message about these, empty without any."""
    if samples.genus and samples.homology is None:
        return proposals, knot_message(samples, mesh)
    missing: tuple[HandleProposal, ...] = ()
    if samples.homology is not None:
        missing = missing_tunnels(samples.homology, proposals, edge=mean_edge(mesh), vertices=mesh.n_vertices)
    if not missing and samples.genus in (None, mesh.genus):
        return proposals, ""
    if missing and all(proposal.reason == REFUSED for proposal in missing):
        return proposals, ""
    why = tunnel_list(missing) if missing else "more vertices may find the handles that are left out"
    message = f"{samples.what} genus {samples.genus}, the model has {mesh.genus}; {why}; init='auto' may find more"
    return (*proposals, *missing), message


def knot_message(samples: Samples, mesh: SimplexMesh) -> str:
    """Return a message about a model of data with indistinguishable tunnels, empty if all of it is on data.

    Films cannot span the tunnel of a knot, and those between its strands connect them.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> ring, ball = sm.torus(48, 24), sm.sphere(8)
    >>> knot = Samples(ring.vertices, ring.normals, oriented=True, genus=1)
    >>> knot_message(knot, ring)
    ''
    >>> knot_message(knot, ball)[:40]
    'the surface has genus 1, the model has 0'
    """
    away = cKDTree(samples.points).query(mesh.vertices)[0]
    astray = float((away > FAR * mean_edge(mesh)).mean())
    if mesh.genus == samples.genus and astray < ASTRAY:
        return ""
    return (
        f"{samples.what} genus {samples.genus}, the model has {mesh.genus}; its tunnels are knotted or cannot be told "
        f"apart, and films between its strands stay: {astray:.1%} of the model is on no data; init='auto' finds them"
    )


def open_data_message(subject: Subject, mesh: SimplexMesh) -> str:
    """Return a message about a closed model of open data, empty if the data has no wide border or the model has holes.

    Examples
    --------
    >>> import simplexmesh as sm
    >>> from simplexmesh.motion.subjects import as_subject
    >>> whole = sm.sphere(16).vertices
    >>> half = as_subject(whole[whole[:, 2] > 0], level=None, label=None, inside="above", components="largest")
    >>> open_data_message(half, sm.sphere(2))[:48]
    'the data ends along a border 2.83 wide, but the '
    """
    border = getattr(subject.target, "border", None)
    if mesh.n_holes or border is None:
        return ""
    diagonal = float(norm(np.ptp(subject.points, axis=0)))
    wide = border.width[border.width >= WIDE * diagonal]
    if not len(wide):
        return ""
    return (
        f"the data ends along a border {wide.max():.3g} wide, but the model is closed: no zone off the data was found "
        f"to open (edges of {mean_edge(mesh):.3g}); more vertices or init='plane' may"
    )
