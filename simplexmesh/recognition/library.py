"""Many models in one file, and which of them a scan shows, where, and how surely."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplexmesh import _check
from simplexmesh.data.points import PointCloud
from simplexmesh.motion.progress import Report, reporting
from simplexmesh.recognition.models import KEPT, Model, model_of
from simplexmesh.recognition.profile import profile_of
from simplexmesh.recognition.ranking import ranked
from simplexmesh.recognition.scene import Scene, without_strays
from simplexmesh.recognition.shelf import Shelf
from simplexmesh.recognition.store import Store
from simplexmesh.recognition.surfaces import surface_of
from simplexmesh.recognition.verify import Evaluation

Array = NDArray[np.float64]

SIDES = ("above", "below")
LONGEST_NAME = 500
MOST_POINTS = 4_000
"""More points of a scan are thinned out at random."""


@dataclass(frozen=True, eq=False, repr=False)
class Recognition:
    """A model that a scan may be of; made by `ModelLibrary.recognise`.

    Attributes
    ----------
    name : str
    T_scan_model : (4, 4) array of float
        Takes the model's coordinates to the scan's frame.
    score : float
        At most 1: the share of the smaller surface that agrees with the other, by distance and normals, less what
        runs near it but not on it; lower where the model has much less area than the scan, which it cannot explain.
    overlap : float
        The share of the scan that lies on the model.
    error : float
        Root mean square distance of the model to the scan's tangent planes, where they overlap, in the data's unit.

    Examples
    --------
    >>> import tempfile
    >>> import simplexmesh as sm
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     library = sm.ModelLibrary(f"{folder}/models.sml")
    ...     library.add("egg", sm.ellipsoid((3, 2, 1), 12))
    ...     found = library.recognise(sm.ellipsoid((3, 2, 1), 14).vertices)
    >>> found[0].name, found[0].T_scan_model.shape
    ('egg', (4, 4))
    """

    name: str
    T_scan_model: Array
    score: float
    overlap: float
    error: float

    def __repr__(self) -> str:
        return f"Recognition({self.name!r}, score {self.score:.2f}, overlap {self.overlap:.0%}, error {self.error:.3g})"


class ModelLibrary:
    """Models in one file, and which of them a scan shows.

    Parameters
    ----------
    path : str or Path
        By convention ending in .sml. Made when the first model is added.

    Raises
    ------
    OSError, TypeError
        The file is not a library, or was cut short; the folder does not exist.

    Notes
    -----
    `len`, `in` and iteration are over names, in the order in which they were added. Models and scans must be in one
    unit. What was added is on disk when `add` returns, and a crash leaves the file as it was before or after. Several
    processes may read and add at the same time.

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
    ...     print(library.recognise(scan[scan[:, 0] > -1])[0].name)
    ['egg', 'ring'] True 2
    ring
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        if not isinstance(path, str | os.PathLike):
            raise TypeError(f"path must be the name of a file, not {type(path).__name__}")
        self._store = Store(Path(path).expanduser())
        self._read_before = b"", Shelf()
        if self._store.exists():
            self._store.stamp()
        elif not self.path.parent.is_dir():
            raise FileNotFoundError(f"there is no folder {self.path.parent} for the library {self.path.name}")

    @property
    def path(self) -> Path:
        """The file."""
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
        """Add a model. When this returns it is on disk.

        Parameters
        ----------
        name : str
        data : SimplexMesh, TriangleMesh, PointCloud, Volume, array, pyvista or trimesh object, path, or scans
            The complete object. Where only a part of it is known, only scans of that part are recognized.
        replace : bool
            Whether a model of that name gives way; otherwise it is an error that there is one.
        level, label, inside, poses
            The surface meant in a volume, and the poses of several scans; as in `reconstruct`.

        Raises
        ------
        ValueError, TypeError, OSError
            A name that is taken; data that is not there, fewer than 50 points; a file that is not a library.
        """
        name = _named(name)
        _check.choice("inside", inside, SIDES)
        if not replace and name in self:
            raise ValueError(_taken(name))
        surface = surface_of(data, "data", level=level, label=label, inside=inside, poses=poses, maximum=KEPT)
        if not self._store.put(name, model_of(without_strays(surface)).packed(), replace=replace):
            raise ValueError(_taken(name))

    def remove(self, name: str) -> None:
        """Remove a model.

        Raises
        ------
        ValueError, TypeError, OSError
            There is none of that name.
        """
        if not self._store.remove(_named(name)):
            raise ValueError(f"name must be that of a model in {self.path}; there is none called {name!r}")

    def points(self, name: str) -> PointCloud:
        """Return what is kept of a model: some thousand points of its surface, with normals.

        Raises
        ------
        ValueError, TypeError, OSError
            There is none of that name.
        """
        name = _named(name)
        shelf = self._read()
        for number, known in shelf.names.items():
            if known == name:
                surface = shelf.models[number].surface
                return PointCloud(surface.points, surface.normals)
        raise ValueError(f"name must be that of a model in {self.path}; there is none called {name!r}")

    def recognise(
        self,
        data: Any,
        *,
        best: int = 5,
        minimum_score: float = 0.1,
        level: float | None = None,
        label: int | None = None,
        inside: str = "above",
        poses: ArrayLike | None = None,
        progress: bool | Report = False,
    ) -> list[Recognition]:
        """Return the models a scan may be of, best first, and where each lies in it.

        Parameters
        ----------
        data : SimplexMesh, TriangleMesh, PointCloud, Volume, array, pyvista or trimesh object, path, or scans
            Of one object, or a part of it, in the models' unit.
        best : int
            How many to return at most.
        minimum_score : float
            Models that fit less are left out; the list may be empty.
        level, label, inside, poses
            The surface meant in a volume, and the poses of several scans; as in `reconstruct`.
        progress : bool or callable
            True shows a bar; a function is called with the share done and a message.

        Returns
        -------
        list of Recognition

        Raises
        ------
        ValueError, TypeError, OSError
            A scan of fewer than 50 points, or on a line; a library that is empty, absent, or not one.
        """
        best = _check.integer("best", best, 1)
        _check.choice("inside", inside, SIDES)
        minimum_score = _check.number("minimum_score", minimum_score, 0.0, 1.0)
        with reporting(progress) as report:
            report(0.0, "reading")
            shelf = self._read()
            if not shelf.names:
                raise ValueError(f"the library {self.path} must hold models to recognize anything; it is empty")
            surface = surface_of(
                data, "data", level=level, label=label, inside=inside, poses=poses, maximum=MOST_POINTS, fine=False
            )
            surface = without_strays(surface)
            scene = Scene.of(surface)
            found = ranked(scene, profile_of(surface), shelf, best, report)
            report(1.0, "done")
        return [
            _told(scene, shelf.names[number], shelf.models[number], evaluation)
            for number, evaluation in found
            if evaluation.score >= minimum_score and np.isfinite(evaluation.error)
        ]

    def _read(self) -> Shelf:
        """Return all models, in memory, as they are in the file now."""
        before, shelf = self._read_before
        now = self._store.stamp()
        if now == before:
            return shelf
        now, names, data = self._store.read(set(shelf.models))
        try:
            shelf = shelf.updated(names, data)
        except ValueError as problem:
            raise OSError(f"{self.path} is damaged: {problem}") from None
        self._read_before = now, shelf
        return shelf


def _named(name: Any) -> str:
    """Return a name, or say what is wrong with it."""
    if not isinstance(name, str):
        raise TypeError(f"name must be a string, not {type(name).__name__}")
    if not 0 < len(name) <= LONGEST_NAME or not name.isprintable():
        raise ValueError(f"name must be 1 to {LONGEST_NAME} printable characters, not {name[:40]!r}")
    return name


def _taken(name: str) -> str:
    return f"name must be new to the library, unless it is to replace the model {name!r} there is"


def _told(scene: Scene, name: str, model: Model, evaluation: Evaluation) -> Recognition:
    """Return a verdict in the data's frames and unit."""
    T = evaluation.T.copy()
    T[:3, 3] = scene.middle + scene.unit * T[:3, 3] - T[:3, :3] @ model.surface.points.mean(axis=0)
    return Recognition(
        name=name,
        T_scan_model=_check.frozen(T),
        score=evaluation.score,
        overlap=float((evaluation.point_scores[1] > 0).mean()),
        error=evaluation.error * scene.unit,
    )
