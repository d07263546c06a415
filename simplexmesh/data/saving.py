"""Write whatever there is to a file."""

from __future__ import annotations

import os
from typing import Any

from simplexmesh._base import checks
from simplexmesh.data.conversion import as_data


def save(data: Any, path: str | os.PathLike[str]) -> None:
    """Write data, a model, a result or a signature to a file in the format its name says.

    Parameters
    ----------
    data : SimplexMesh, TriangleMesh, PointCloud, Volume, Reconstruction, SAI, array, or object of another library
        Whatever is saved by a method `save` of its own; of a result, its mesh; of a primitive, its triangles; of what
        functions take as data, that.
    path : str or Path
        Meshes: .vtp, .ply, .obj, .off, .stl, and .glb or .3mf with the extra `export`. Points: .vtp, .ply, .xyz, and
        .las, .laz or .e57 with the extra `survey`. Volumes: .mha, .nrrd, .nii, .nii.gz, .vti.

    Raises
    ------
    TypeError
        Nothing that can be saved.
    ValueError
        An ending that is unknown, or for another kind of data.
    OSError
        The file cannot be written; it is then as it was before.

    Examples
    --------
    >>> import pathlib, tempfile, simplexmesh as sm
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     sm.save(sm.sphere(4), f"{folder}/ball.ply")
    ...     sm.save([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], f"{folder}/corners.xyz")
    ...     sorted(each.name for each in pathlib.Path(folder).iterdir())
    ['ball.ply', 'corners.xyz']
    """
    checks.path("path", path)
    own = type(data).__module__.startswith("simplexmesh.")
    if own and not hasattr(data, "save"):
        data = data.triangulated() if hasattr(data, "triangulated") else getattr(data, "mesh", data)
    (data if own and hasattr(data, "save") else as_data(data)).save(path)
