"""Every real file reads as what its README says it is."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial import cKDTree

import simplexmesh as sm

pytestmark = pytest.mark.data

VOLUMES = {
    "head_ct.mhd": ((64, 64, 93), np.int16, (3.2, 3.2, 1.5), (0, 3926)),
    "head_mr.mhd": ((48, 62, 42), np.uint8, (4, 4, 4), (0, 255)),
    "vase_ct.vti": ((115, 101, 75), np.uint8, (1, 1, 1), None),
    "tooth.nhdr": ((103, 94, 161), np.uint16, (1, 1, 1), (0, 1300)),
    "fetal_t2.nrrd": ((117, 159, 126), np.float32, (0.859375,) * 3, None),
    "avf_mra.nii.gz": ((74, 93, 20), np.float32, (0.722656, 0.722656, 1), None),
}
SURFACES = {  # vertices, faces, closed, genus of closed ones (of all components together)
    "fetal_cortex.vtk": (26851, 53714, True, 4),
    "avf_surface.vtk": (4661, 9314, True, 0),
    "fran_face.vtk": (2205, 4224, False, None),
    "rabbit_scan.vtk": (10429, 20715, False, None),
    "part_scan.ply": (3627, 7052, False, None),
    "lion_head.off": (8356, 16674, False, None),
    "mannequin.off": (12977, 25888, False, None),
    "femur.off": (3897, 7798, True, 2),
    "spot.obj": (2930, 5856, True, 0),
    "ellipsoid.off": (1556, 3108, True, 0),
    "torus.stl": (4350, 8700, True, 1),
    "knot1.off": (3200, 6400, True, 1),
    "eight.off": (315, 634, True, 2),
    "elephant.off": (2775, 5558, True, 3),
    "fandisk.off": (6475, 12946, True, 0),
    "anchor.off": (3793, 7598, True, 4),
    "coupling.off": (1841, 3714, True, 9),
    "featuretype.stl": (1722, 3476, True, 9),
    "angle_block.stl": (352, 704, True, 1),
    "fixed_top.ply": (2374, 4772, True, 7),
    "tray_bottom.stl": (2216, 4520, True, 23),
    "abc8.stl": (1529, 3058, True, 1),
}
CLOUDS = {
    "bun000.ply": (40256, True),
    "bun045.ply": (40097, True),
    "bun090.ply": (30379, True),
    "bun180.ply": (40251, True),
    "bun270.ply": (31701, True),
    "bun315.ply": (35336, True),
    "car_cloud400.csv": (24989, True),
    "car_cloud401.csv": (25193, False),
    "kitten.xyz": (5210, True),
    "abc_00949.xyzc": (10000, False),
    "cyl_fixture.ply": (36573, True),
    "osd_learn37.pcd": (170539, False),
    "ros_table.pcd": (23239, False),
    "box_rgbd.ply": (33183, False),
    "fit4cad_PC18.txt": (6084, False),
    "fit4cad_PC42.txt": (5000, False),
    "fit4cad_PC49.txt": (5000, False),
}
COMPONENTS = {"avf_surface.vtk": 2}
REPAIRED = pytest.mark.filterwarnings("ignore:.*(merged|left out):simplexmesh._base.errors.SimplexMeshWarning")


@pytest.mark.parametrize("name", VOLUMES)
def test_volumes(data_folder, name):
    shape, kind, spacing, extremes = VOLUMES[name]
    volume = sm.read(data_folder / name)
    assert isinstance(volume, sm.Volume)
    assert volume.shape == shape
    assert volume.values.dtype == kind
    assert_allclose(volume.spacing, spacing, rtol=1e-6)
    assert extremes in (None, volume.range)
    assert not volume.is_labels


@REPAIRED
@pytest.mark.parametrize("name", SURFACES)
def test_surfaces(data_folder, name):
    n_vertices, n_faces, closed, genus = SURFACES[name]
    mesh = sm.read(data_folder / name)
    assert isinstance(mesh, sm.TriangleMesh)
    assert (mesh.n_vertices, mesh.n_faces, mesh.is_closed) == (n_vertices, n_faces, closed)
    if closed:
        assert n_vertices - n_faces / 2 == 2 * COMPONENTS.get(name, 1) - 2 * genus


@REPAIRED
@pytest.mark.parametrize("name", CLOUDS)
def test_clouds(data_folder, name):
    n, oriented = CLOUDS[name]
    cloud = sm.read(data_folder / name)
    assert isinstance(cloud, sm.PointCloud)
    assert len(cloud) == n
    assert (cloud.normals is not None) is oriented


@pytest.mark.filterwarnings("ignore::simplexmesh._base.errors.SimplexMeshWarning")
@pytest.mark.parametrize(
    "name", ["car_poses.csv", "bun.conf", "fit4cad_PC18_primitives.txt", "README.md", "head_ct.raw"]
)
def test_what_is_no_data_is_refused(data_folder, name):
    with pytest.raises((OSError, ValueError), match=name.split(".")[0]):
        sm.read(data_folder / name)


class TestPoses:
    @staticmethod
    def scan(folder, poses, name):
        return sm.read(folder / name).transformed(poses[name])

    def test_bunny_scans_meet(self, data_folder):
        """README: 84 % of bun000 lie within 1 mm of bun045 with the conjugated quaternion, 2 % at most without."""
        poses = sm.read_poses(data_folder / "bun.conf")
        assert len(poses) == 10
        a, b = (self.scan(data_folder, poses, name) for name in ("bun000.ply", "bun045.ply"))
        distance, nearest = cKDTree(b.points).query(a.points)
        assert (distance < 1e-3).mean() > 0.84
        close = distance < 5e-4
        cosines = np.einsum("ij,ij->i", a.normals[close], b.normals[nearest[close]])
        assert np.median(cosines) > np.cos(np.radians(6))
        assert (cosines < 0).mean() < 0.001

    def test_bunny_normals_point_outward(self, data_folder):
        poses = sm.read_poses(data_folder / "bun.conf")
        names = [name for name in CLOUDS if name.startswith("bun")]
        bunny = sm.PointCloud.joined([self.scan(data_folder, poses, name) for name in names])
        outward = np.einsum("ij,ij->i", bunny.points - bunny.points.mean(axis=0), bunny.normals)
        assert (outward > 0).mean() > 0.85

    def test_car_scans_meet(self, data_folder):
        poses = sm.read_poses(data_folder / "car_poses.csv")
        a, b = (self.scan(data_folder, poses, name) for name in ("car_cloud400.csv", "car_cloud401.csv"))
        assert (cKDTree(a.points).query(b.points)[0] < 0.05).mean() > 0.2


@REPAIRED
class TestPhysicalSpace:
    """Surfaces that belong to volumes are in RAS, volumes in LPS: x and y change sign."""

    LPS_RAS = np.diag([-1.0, -1, 1, 1])

    def test_the_vessel_lies_where_the_angiography_is_bright(self, data_folder):
        volume = sm.read(data_folder / "avf_mra.nii.gz")
        vessel = sm.read(data_folder / "avf_surface.vtk").transformed(self.LPS_RAS)
        ijk = np.rint(volume.to_index(vessel.vertices)).astype(int)
        inside = ((ijk >= 0) & (ijk < volume.shape)).all(axis=1)
        assert inside.mean() > 0.98
        assert volume.values[tuple(ijk[inside].T)].mean() > 5 * np.median(volume.values)

    def test_the_cortex_lies_inside_the_brain(self, data_folder):
        volume = sm.read(data_folder / "fetal_t2.nrrd")
        cortex = sm.read(data_folder / "fetal_cortex.vtk").transformed(self.LPS_RAS)
        ijk = np.rint(volume.to_index(cortex.vertices)).astype(int)
        assert ((ijk >= 0) & (ijk < volume.shape)).all()
        assert (volume.values[tuple(ijk.T)] > 0).mean() > 0.99


def test_the_frog_is_a_volume_of_labels():
    from pyvista import examples

    frog = sm.read(examples.__path__[0] + "/frog_tissues.vti")
    assert frog.shape == (500, 470, 136)
    assert_allclose(frog.spacing, [1, 1, 1.5])
    assert frog.is_labels
    assert len(frog.labels()) == 26
    assert frog.values.dtype == np.uint8
