"""Poses in files: those of range scans from Stanford .conf, JSON and CSV, those that were found as JSON."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh._base.drafts import draft
from simplexmesh.data.json_text import json_text

_ROUNDING = 1e-3


def read_poses(path: str | os.PathLike[str]) -> dict[str, Array]:
    """Read the poses of several scans from one file.

    Three formats are supported:

    - Stanford `.conf`: lines ``bmesh name tx ty tz qx qy qz qw``. The quaternion there is the conjugate of the
      rotation from scan to world: ``x_world = R(conj(q)) x + t``.
    - JSON: ``{"name": [[4 numbers], ... 4 rows], ...}``, T_world_scan.
    - CSV: a header, then lines ``name, 16 numbers`` of T_world_scan by rows (libpointmatcher's lists).

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    dict of str to (4, 4) array of float
        T_world_scan by the scan's file name as written there: maps coordinates in the scan to the common frame.

    Raises
    ------
    OSError
        The file does not exist or holds no poses.
    ValueError
        A pose is not a rigid transform.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "scans.conf")
    ...     _ = path.write_text("bmesh front.ply 1 2 3 0 0 0 1")
    ...     read_poses(path)["front.ply"][:3, 3]
    array([1., 2., 3.])
    """
    where = checks.path("path", path)
    if not where.is_file():
        raise FileNotFoundError(f"path must be a file of poses, {os.fspath(path)!r} does not exist")
    text = where.read_text(encoding="utf-8", errors="replace")
    try:
        if text.lstrip().startswith("{"):
            poses = {str(name): _matrix(name, T) for name, T in json.loads(text).items()}
        elif "bmesh" in text:
            poses = dict(_stanford_pose(line.split()) for line in text.splitlines() if line.startswith("bmesh"))
        else:
            poses = dict(_csv_pose(line.split(",")) for line in text.splitlines()[1:] if line.strip())
    except (ValueError, TypeError, IndexError) as error:
        raise OSError(f"{where.name} must hold poses (Stanford .conf, JSON or CSV): {error}") from None
    if not poses:
        raise OSError(f"{where.name} must hold poses (Stanford .conf, JSON or CSV), it holds none")
    return {name: rigid(f"{where.name}: pose of {name}", T) for name, T in poses.items()}


def write_poses(path: str | os.PathLike[str], poses: Mapping[str, Array]) -> None:
    """Write poses (4, 4) by name as JSON, which `read_poses` reads."""
    where = checks.path("path", path)
    if where.suffix.lower() != ".json":
        raise ValueError(f"path must end with .json for poses, not {where.suffix or 'nothing'} ({where.name})")
    with draft(where) as part:
        part.write_text(json_text(poses) + "\n", encoding="utf-8")


class Posed:
    """What has the pose of a source on a target."""

    T_target_source: Array

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the pose to a .json file, as that of "source", which `read_poses` reads."""
        write_poses(path, {"source": self.T_target_source})


def rigid(name: str, T: ArrayLike) -> Array:
    """Return a (4, 4) rigid transform, checked."""
    out = checks.array(name, T, (4, 4))
    R = out[:3, :3]
    if not np.array_equal(out[3], [0, 0, 0, 1]):
        raise ValueError(f"{name} must have the last row (0, 0, 0, 1), not ({', '.join(f'{x:g}' for x in out[3])})")
    lengths = np.linalg.norm(R, axis=0)
    off = float(np.abs(R.T @ R - np.eye(3)).max())
    if not off <= _ROUNDING:
        scale = f"it scales by {', '.join(f'{s:g}' for s in lengths)}"
        scaled = np.abs(lengths - 1).max() > _ROUNDING / 4
        raise ValueError(f"{name} must be a rotation and a translation; {scale if scaled else 'it shears'}")
    if np.linalg.det(R) < 0:
        raise ValueError(f"{name} must be a rotation and a translation; it is a reflection")
    return out


def _matrix(name: str, T: ArrayLike) -> Array:
    return checks.array(f"pose of {name}", T, (4, 4))


def _stanford_pose(words: list[str]) -> tuple[str, Array]:
    if len(words) != 9:
        raise ValueError(f"a line must be bmesh, name and 7 numbers, not {len(words)} words")
    from scipy.spatial.transform import Rotation

    *t, x, y, z, w = (float(word) for word in words[2:])
    if not any((x, y, z, w)):
        raise ValueError(f"quaternion of {words[1]} must not be zero")
    T = np.eye(4)
    T[:3, :3] = Rotation.from_quat([x, y, z, w]).as_matrix().T
    T[:3, 3] = t
    return words[1], _matrix(words[1], T)


def _csv_pose(words: list[str]) -> tuple[str, Array]:
    name = words[0].strip()
    if len(words) != 17:
        raise ValueError(f"a line must be a name and 16 numbers, with commas between them, not {len(words)} words")
    return name, _matrix(name, np.array([float(word) for word in words[1:]]).reshape(4, 4))
