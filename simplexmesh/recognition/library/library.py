"""Recognition of scans: a library of models in one file, and the pose of the recognized ones in a scan."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from simplexmesh._base import checks
from simplexmesh._base.arrays import Array
from simplexmesh._base.errors import warn
from simplexmesh._base.progress import Progress, reporting
from simplexmesh.data.points import PointCloud
from simplexmesh.motion.reconstruct.outer_side import are_inward
from simplexmesh.recognition.library.global_descriptor import global_descriptor
from simplexmesh.recognition.library.model_index import ModelIndex
from simplexmesh.recognition.library.models import Model, model_of
from simplexmesh.recognition.library.ranking import ranked
from simplexmesh.recognition.library.scene import Scene, without_outliers
from simplexmesh.recognition.library.store import Store
from simplexmesh.recognition.register.icp import between_frames
from simplexmesh.recognition.register.oriented_points import OrientedPoints, oriented_points
from simplexmesh.recognition.register.verify import Evaluation

MOST_POINTS = 4_000
"""Larger models and scans are subsampled at random: more points take longer, and more memory for each model."""


@dataclass(frozen=True, eq=False, repr=False)
class Recognition:
    """A model recognized in a scan; made by `ModelLibrary.recognize`.

    Attributes
    ----------
    name : str
    T_target_source : (4, 4) array of float
        Maps the model's coordinates to the scan's frame.
    score : float
        At most 1: the fraction of the smaller surface that agrees with the other in distance and normals, less what is
        near but off it; lowered if the model's area is too small to explain the scan.
    overlap : float
        The fraction of the scan that lies on the model.
    error : float
        Root mean square distance of the model to the scan's tangent planes, where they overlap, in the data's unit.

    Examples
    --------
    >>> import tempfile
    >>> import simplexmesh as sm
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     library = sm.ModelLibrary(f"{folder}/models.sml")
    ...     library.add("egg", sm.ellipsoid((3, 2, 1), 12))
    ...     found = library.recognize(sm.ellipsoid((3, 2, 1), 14).vertices)
    >>> found[0].name, found[0].T_target_source.shape
    ('egg', (4, 4))
    """

    name: str
    T_target_source: Array
    score: float
    overlap: float
    error: float

    def __repr__(self) -> str:
        return f"Recognition({self.name!r}, score {self.score:.2f}, overlap {self.overlap:.0%}, error {self.error:.3g})"


class ModelLibrary:
    """A library of models in one file, to recognize scans.

    Parameters
    ----------
    path : str or Path
        By convention ending in .sml. Created when the first model is added.

    Raises
    ------
    OSError, TypeError
        The file is not a library, or is truncated; the folder does not exist.

    Notes
    -----
    `len`, `in` and iteration are over names, in the order in which they were added. Models and scans must be in one
    unit. Changes are atomic and on disk when a method returns. Several processes may read and add at the same time.

    Examples
    --------
    >>> import tempfile
    >>> import simplexmesh as sm
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     library = sm.ModelLibrary(f"{folder}/models.sml")
    ...     library.add("egg", sm.ellipsoid((3, 2, 1), 12))
    ...     library.add("ring", sm.torus(radius=2.0, tube_radius=0.7))
    ...     print(list(library), "egg" in library, len(library))
    ...     scan = sm.torus(radius=2.0, tube_radius=0.7).triangulated().sampled(3000, rng=0).points
    ...     print(library.recognize(scan[scan[:, 0] > -1])[0].name)
    ['egg', 'ring'] True 2
    ring
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._store = Store(checks.path("path", path))
        self._cached = b"", ModelIndex()
        if self._store.exists():
            self._store.stamp()
        elif not self.path.parent.is_dir():
            raise FileNotFoundError(f"there is no folder {self.path.parent} for the library {self.path.name}")

    @property
    def path(self) -> Path:
        """Path of the file."""
        return self._store.path

    def __repr__(self) -> str:
        return f"ModelLibrary({str(self.path)!r}, {len(self)} models)"

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all models, in the order in which they were added."""
        return tuple(self._store.names())

    def __len__(self) -> int:
        return len(self.names)

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __contains__(self, name: object) -> bool:
        return name in self.names

    def add(
        self,
        name: str,
        data: Any,
        *,
        replace: bool = False,
        level: float | None = None,
        label: int | None = None,
        inside: str = "above",
        poses: ArrayLike | None = None,
    ) -> None:
        """Add a model to the file.

        Parameters
        ----------
        name : str
        data : SimplexMesh, TriangleMesh, PointCloud, Volume, array, pyvista or trimesh object, path, or scans
            The complete object; of an incomplete one only scans of the known part are recognized.
        replace : bool
            Whether to replace a model of that name; otherwise an existing name is an error.
        level, label, inside, poses
            The surface of a volume, and the poses of several scans; as in `reconstruct`.

        Raises
        ------
        ValueError, TypeError, OSError
            A name that exists; data that is missing, fewer than 50 points; a file that is not a library.
        """
        name = _checked_name(name)
        checks.choice("inside", inside, ("above", "below"))
        if not replace and name in self:
            raise ValueError(_name_taken(name))
        surface = oriented_points(
            data, "data", level=level, label=label, inside=inside, poses=poses, maximum=MOST_POINTS
        )
        if surface.given and are_inward(surface.points, surface.normals, surface.points.mean(axis=0)):
            warn("the normals of the data point inwards and were flipped")
            surface = surface.flipped()
        if not self._store.put(name, model_of(without_outliers(surface)).packed(), replace=replace):
            raise ValueError(_name_taken(name))

    def remove(self, name: str) -> None:
        """Remove a model.

        Raises
        ------
        ValueError, TypeError, OSError
            No model has that name.
        """
        if not self._store.remove(_checked_name(name)):
            raise ValueError(f"name must be that of a model in {self.path}, not {name!r}")

    def points(self, name: str) -> PointCloud:
        """Return the stored points of a model's surface, at most 4,000, with normals.

        Raises
        ------
        ValueError, TypeError, OSError
            No model has that name.
        """
        name, index = _checked_name(name), self._read()
        for identity, known in index.names.items():
            if known == name:
                surface = index.models[identity].surface()
                return PointCloud(surface.points, surface.normals)
        raise ValueError(f"name must be that of a model in {self.path}, not {name!r}")

    def recognize(
        self,
        data: Any,
        *,
        best: int = 5,
        minimum_score: float = 0.1,
        level: float | None = None,
        label: int | None = None,
        inside: str = "above",
        poses: ArrayLike | None = None,
        progress: bool | Progress = False,
    ) -> tuple[Recognition, ...]:
        """Return the models recognized in a scan, best first, and their poses.

        Parameters
        ----------
        data : SimplexMesh, TriangleMesh, PointCloud, Volume, array, pyvista or trimesh object, path, or scans
            Of one object or a part of it, in the models' unit.
        best : int
            Maximum number of models.
        minimum_score : float
            Models with lower scores are omitted; there may be none.
        level, label, inside, poses
            The surface of a volume, and the poses of several scans; as in `reconstruct`.
        progress : bool or callable
            True shows a bar; a function is called with the fraction done and a message.

        Returns
        -------
        tuple of Recognition

        Raises
        ------
        ValueError, TypeError, OSError
            A scan of fewer than 50 points, or collinear; a library that is empty, missing, or of another format.
        """
        best = checks.integer("best", best, 1)
        checks.choice("inside", inside, ("above", "below"))
        minimum_score = checks.number("minimum_score", minimum_score, 0.0, 1.0)
        with reporting(progress, "recognizing") as report:
            report(0.0, "reading")
            index = self._read()
            if not index.names:
                raise ValueError(f"the library {self.path} must hold models to recognize anything; it is empty")
            surface = oriented_points(
                data, "data", level=level, label=label, inside=inside, poses=poses, maximum=MOST_POINTS, fine=False
            )
            surface = without_outliers(surface)
            found = _recognized(surface, index, best, minimum_score, report)
            if not found and surface.given:
                found = _recognized(surface.flipped(), index, best, minimum_score, report)
                if found:
                    warn("the normals of the data are opposite to those of the models and were flipped")
            report(1.0, "done")
        return tuple(found)

    def _read(self) -> ModelIndex:
        """Return the index of all models, updated if the file has changed."""
        cached, index = self._cached
        if self._store.stamp() == cached:
            return index
        stamp, names, data = self._store.read(set(index.models))
        try:
            index = index.updated(names, data)
        except ValueError as error:
            raise OSError(f"{self.path} is damaged: {error}") from None
        self._cached = stamp, index
        return index


def _recognized(
    surface: OrientedPoints, index: ModelIndex, best: int, minimum_score: float, report: Progress
) -> list[Recognition]:
    """Return the models recognized in a surface, best first."""
    scene = Scene.of(surface)
    found = ranked(scene, global_descriptor(surface), index, best, report)
    return [
        _as_recognition(scene, index.names[identity], index.models[identity], evaluation)
        for identity, evaluation in found
        if evaluation.score >= minimum_score and np.isfinite(evaluation.error)
    ]


def _checked_name(name: Any) -> str:
    """Return a valid name."""
    if not isinstance(name, str):
        raise TypeError(f"name must be a string, not {type(name).__name__}")
    if not 0 < len(name) <= 500 or not name.isprintable():
        raise ValueError(f"name must be 1 to 500 printable characters, not {name[:40]!r}")
    return name


def _name_taken(name: str) -> str:
    return f"name must be new to the library, not {name!r}; replace=True replaces the model of that name"


def _as_recognition(scene: Scene, name: str, model: Model, evaluation: Evaluation) -> Recognition:
    """Return an evaluation in the frames and unit of the data."""
    return Recognition(
        name=name,
        T_target_source=checks.frozen(between_frames(evaluation.T, model.frame[0], scene.center, scene.unit)),
        score=evaluation.score,
        overlap=float((evaluation.point_scores[1] > 0).mean()),
        error=evaluation.error * scene.unit,
    )
