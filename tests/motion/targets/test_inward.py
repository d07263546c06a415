"""Faces that are turned inward."""

import warnings

import numpy as np
import pytest
import pyvista as pv

import simplexmesh as sm
from simplexmesh.motion.targets.inward import warn_inward


@pytest.mark.parametrize("thickness", [20.0, 0.5, 1e-3])
def test_one_of_two_sheets_inside_out_is_told(thickness):
    """A step away from a face led through sheets thinner than a hundredth of their size, and nothing was told."""
    box = pv.Box([-50, 50, -50, 50, 0, thickness]).triangulate().clean(tolerance=0)
    faces = box.regular_faces
    vertices = np.concatenate([box.points, np.add(box.points, [0, 0, 50])])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_inward("surface", sm.TriangleMesh(vertices, np.concatenate([faces, faces + 8])), "this is bad")
    turned = sm.TriangleMesh(vertices, np.concatenate([faces, faces[:, ::-1] + 8]))
    with pytest.warns(sm.SimplexMeshWarning, match="surface has inward normals, 12 of its 24 faces, so this is bad"):
        warn_inward("surface", turned, "this is bad")
