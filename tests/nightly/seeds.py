"""Small sound files of every format and variety that is read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import plyfile
import pyvista
import SimpleITK as sitk
from nibabel import gifti
from vtkmodules.vtkIOLegacy import vtkDataSetWriter
from vtkmodules.vtkIOXML import vtkXMLImageDataWriter, vtkXMLPolyDataWriter

import simplexmesh as sm

# Real files from the folder of data, one of each kind
REAL = [
    *("spot.obj", "torus.stl", "fran_face.vtk", "avf_surface.vtk", "vase_ct.vti", "avf_mra.nii.gz", "part_scan.ply"),
    *("ros_table.pcd", "eight.off", "bun.conf", "kitten.xyz", "head_mr.mhd", "tooth.nhdr", "fixed_top.ply"),
]

_VTK = [f"{mode}-{pack}" for mode in ("Ascii", "Binary", "Appended") for pack in ("None", "ZLib")]
_KINDS = ("polygons", "image")
WRITTEN = [
    *(f"{name}.{ending}" for name in _VTK for ending in ("vtp", "vti")),
    *(f"{name}-{version}-{kind}.vtk" for name in _KINDS for version in (42, 51) for kind in ("ASCII", "Binary")),
    *("mesh.vtp", "mesh.ply", "mesh.obj", "mesh.off", "mesh.stl", "mesh.glb", "mesh.3mf", "text.stl", "text.ply"),
    *("cloud.vtp", "cloud.ply", "cloud.xyz", "cloud.csv", "text.pcd", "binary.pcd", "packed.pcd", "mesh.gii"),
    *("a.mha", "a.mhd", "a.nrrd", "a.nhdr", "a.nii", "a.nii.gz", "a.hdr", "a.tif", "a.dcm"),
    *("packed.mha", "packed.nrrd", "signature.npz", "models.sml"),
]


def write(folder: Path) -> list[Path]:
    """Write one file of every variety; return those that can be read alone."""
    bare = sm.sphere(4)
    ball = bare.with_data(weight=np.arange(320))
    triangles = ball.triangulated()
    for name in ("mesh.vtp", "mesh.ply", "mesh.obj", "mesh.off", "mesh.stl", "mesh.glb", "mesh.3mf"):
        (ball if name in ("mesh.vtp", "mesh.ply") else bare).save(folder / name)  # others hold no such array
    table = (("POINTSET", triangles.vertices, "f4"), ("TRIANGLE", triangles.faces, "i4"))
    arrays = [gifti.GiftiDataArray(values.astype(kind), f"NIFTI_INTENT_{name}") for name, values, kind in table]
    gifti.GiftiImage(darrays=arrays).to_filename(folder / "mesh.gii")
    cloud = sm.PointCloud(ball.vertices, ball.normals)
    for name in ("cloud.vtp", "cloud.ply", "cloud.xyz"):
        cloud.save(folder / name)
    (folder / "cloud.csv").write_text("x,y,z\n" + "".join(f"{x},{y},{z}\n" for x, y, z in ball.vertices.tolist()[:50]))
    text = plyfile.PlyData.read(folder / "mesh.ply")
    text.text = True
    text.write(folder / "text.ply")
    _write_vtk(folder, ball.to_pyvista())
    _write_pcd(folder, ball.vertices.astype("<f4"))
    _write_volumes(folder)
    sm.sai(triangles, frequency=5).save(folder / "signature.npz")
    sm.ModelLibrary(folder / "models.sml").add("ball", triangles)
    corners = triangles.vertices[triangles.faces[:40]].tolist()
    loops = ["".join(f"vertex {x} {y} {z}\n" for x, y, z in face) for face in corners]
    facets = "".join(f"facet normal 0 0 1\nouter loop\n{loop}endloop\nendfacet\n" for loop in loops)
    (folder / "text.stl").write_text(f"solid x\n{facets}endsolid x\n")
    return sorted(path for path in folder.iterdir() if path.suffix not in (".raw", ".img", ".zraw"))


def _write_vtk(folder: Path, surface: pyvista.PolyData) -> None:
    grid = pyvista.ImageData(dimensions=(6, 7, 8))
    grid["values"] = np.random.default_rng(0).integers(0, 999, 336).astype(np.int16)
    for writer, dataset, ending in ((vtkXMLPolyDataWriter(), surface, "vtp"), (vtkXMLImageDataWriter(), grid, "vti")):
        for mode in ("Ascii", "Binary", "Appended"):
            for pack in ("None", "ZLib"):
                writer.SetFileName(str(folder / f"{mode}-{pack}.{ending}"))
                writer.SetInputData(dataset)
                getattr(writer, f"SetDataModeTo{mode}")()
                getattr(writer, f"SetCompressorTypeTo{pack}")()
                writer.EncodeAppendedDataOff()
                writer.Write()
    for dataset, name in ((surface, "polygons"), (grid, "image")):
        for version in (42, 51):
            for kind in ("ASCII", "Binary"):
                writer = vtkDataSetWriter()
                writer.SetFileName(str(folder / f"{name}-{version}-{kind}.vtk"))
                writer.SetFileVersion(version)
                writer.SetInputData(dataset)
                getattr(writer, f"SetFileTypeTo{kind}")()
                writer.Write()


def _write_pcd(folder: Path, points: np.ndarray) -> None:
    head = (
        f"# .PCD v0.7\nVERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {len(points)}\nHEIGHT 1\n"
    )
    head += f"VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(points)}\nDATA "
    (folder / "binary.pcd").write_bytes(f"{head}binary\n".encode() + points.tobytes())
    rows = "".join(f"{x} {y} {z}\n" for x, y, z in points.tolist())
    (folder / "text.pcd").write_text(f"{head}ascii\n{rows}")
    columns = np.ascontiguousarray(points.T).tobytes()
    pieces = [columns[at : at + 32] for at in range(0, len(columns), 32)]
    packed = b"".join(bytes([len(piece) - 1]) + piece for piece in pieces)  # literal runs of LZF
    sizes = np.array([len(packed), len(columns)], "<u4").tobytes()
    (folder / "packed.pcd").write_bytes(f"{head}binary_compressed\n".encode() + sizes + packed)


def _write_volumes(folder: Path) -> None:
    values = np.random.default_rng(0).integers(0, 3000, (6, 7, 8)).astype(np.int16)
    image = sitk.GetImageFromArray(values)
    for name in ("a.mha", "a.mhd", "a.nrrd", "a.nhdr", "a.nii", "a.nii.gz", "a.hdr", "a.tif"):
        sitk.WriteImage(image, str(folder / name))
    for name in ("packed.mha", "packed.nrrd"):
        sitk.WriteImage(image, str(folder / name), useCompression=True)
    sitk.WriteImage(sitk.GetImageFromArray(values.astype(np.uint16)), str(folder / "a.dcm"))
