"""Zones of a surface, each fit for one patch of a CAD model."""

from __future__ import annotations

from typing import Any

import numpy as np

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array, Indices
from simplexmesh.surface.features.feature_lines import network_on
from simplexmesh.surface.features.lines.network import FeatureNetwork
from simplexmesh.surface.features.zoning import edits
from simplexmesh.surface.features.zoning._kernels_fronts import grow
from simplexmesh.surface.features.zoning.bending import bending
from simplexmesh.surface.features.zoning.result import Zones, zoned

FEWEST = 8
"""Triangles of a zone that bends differently: bending is a mean over about as many."""


def zones(surface: Any, network: FeatureNetwork | None = None, *, tolerance: float | None = None) -> Zones:
    """Return the zones of a surface between its sharp edges, and between parts that bend differently.

    Parameters
    ----------
    surface : TriangleMesh, SimplexMesh, PyVista or trimesh object, pair of arrays, or path
        The surface.
    network : FeatureNetwork, optional
        Its sharp edges; by default those that `feature_lines` finds.
    tolerance : float, optional
        A curvature, 1 / length, not a length: zones also end where the surface goes on smoothly with a curvature that
        differs by more than this from that of the triangle from which the zone grew (the root of the sum of the squared
        principal curvatures: 0 in planes, 1 / radius on cylinders). Default: at sharp edges only.

    Returns
    -------
    Zones
        One for each component of a surface without sharp edges.

    Raises
    ------
    ValueError, TypeError
        A network of another surface, a tolerance that is not above 0, not a surface of triangles.
    TopologyError
        When an edge has more than two triangles, or the surface is one-sided.

    References
    ----------
    P. Veron, S. Lesage and J.-C. Leon, *Outils de base pour l'extraction de caracteristiques de surfaces numerisees*,
    1998, section 5: fronts from the triangles that bend most, then from flat ones, then from those between.

    Examples
    --------
    >>> import pyvista as pv, simplexmesh as sm
    >>> sm.zones(sm.divided(pv.Cube().triangulate().clean(), 0.1)).kinds
    ('plane', 'plane', 'plane', 'plane', 'plane', 'plane')
    """
    network = network_on(surface, network)
    found, sharp = network._found, network._chosen
    labels = found.edges.zones(sharp)
    if tolerance is not None:
        tolerance = checks.number("tolerance", tolerance, 0.0, open_low=True)
        values = bending(found, labels)
        labels = np.full(len(labels), -1)
        order = _priorities(values, tolerance)
        grow(labels, order, values, tolerance, found.edges.facets.mates, found.edges.halved(sharp))
        few = np.bincount(labels) < FEWEST
        labels = labels if few.all() else edits.dissolved(labels, few, found.edges, sharp)
    return zoned(network, labels)


def _priorities(values: Array, tolerance: float) -> Indices:
    """Return triangles in the order of seeds: high curvature, from the highest on, flat ones, then those between."""
    high, flat = values > 0.5 * values.max(initial=0.0), values <= tolerance
    rank = np.where(flat, 1, np.where(high, 0, 2))
    return np.lexsort((-values, rank))
