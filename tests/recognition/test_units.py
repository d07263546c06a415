"""Two things in two units of length are never compared, aligned or moved to each other."""

from __future__ import annotations

import numpy as np
import pytest

import simplexmesh as sm

EGG = sm.ellipsoid((3, 2, 1), 8)
EGG = EGG.moved(EGG.vertices + 0.1 * EGG.vertices**2)
MM, M = EGG.in_unit("mm", "mm"), EGG.in_unit("m", "m")
TRIANGLES, CLOUD = M.triangulated(), sm.PointCloud(M.vertices, unit="m")
VOLUME = sm.Volume(np.pad(np.ones((4, 4, 4), np.uint8), 2), unit="m")

DOORS = {
    "deviation": lambda: sm.deviation(MM, TRIANGLES),
    "deviation of points": lambda: sm.deviation(sm.PointCloud(MM.vertices, unit="mm"), TRIANGLES),
    "align": lambda: sm.align(MM, CLOUD, (EGG.vertices[:9], EGG.vertices[:9])),
    "register": lambda: sm.register(MM, CLOUD),
    "register_all": lambda: sm.register_all([MM, CLOUD]),
    "occlude": lambda: sm.occlude(MM, TRIANGLES),
    "reconstruct": lambda: sm.reconstruct(CLOUD, init=MM),
    "boolean": lambda: sm.boolean(MM.triangulated(), TRIANGLES, "union"),
    "triangles": lambda: sm.DeformableModel(MM, sm.targets.Triangles(TRIANGLES)),
    "points": lambda: sm.DeformableModel(MM, sm.targets.Points(CLOUD)),
    "level": lambda: sm.DeformableModel(MM, sm.targets.Isosurface(VOLUME, 0.5)),
    "label": lambda: sm.DeformableModel(MM, sm.targets.LabelSurface(VOLUME)),
    "union": lambda: sm.DeformableModel(MM, sm.targets.Union([sm.targets.Points(CLOUD)])),
    "refine": lambda: sm.refine(MM, TRIANGLES, vertices=2000),
    "redistribute": lambda: sm.redistribute(MM, CLOUD, rounds=0),
    "open_holes": lambda: sm.open_holes(MM, sm.targets.Triangles(TRIANGLES)),
    "add_handles": lambda: sm.add_handles(MM, sm.targets.Triangles(TRIANGLES)),
    "targets": lambda: sm.targets.Union([sm.targets.Points(CLOUD), sm.targets.Triangles(MM.triangulated())]),
}


@pytest.mark.parametrize("door", DOORS)
def test_two_units_are_refused(door):
    with pytest.raises(ValueError, match="must have one unit, not m and mm: use in_unit"):
        DOORS[door]()


def test_a_library_has_one_unit_and_keeps_it(tmp_path):
    library = sm.ModelLibrary(tmp_path / "models.sml")
    library.add("unknown", EGG)
    library.add("egg", MM)
    refused = pytest.raises(ValueError, match="data and the models must have one unit, not m and mm")
    with refused:
        library.add("other", M)
    with refused:
        library.recognize(CLOUD)
    library = sm.ModelLibrary(library.path)
    assert library.points("egg").unit == "mm"
    assert library.points("unknown").unit is None
    assert library.recognize(M.in_unit("mm"), minimum_score=0.0) is not None
    library.add("egg", M, replace=True)
    assert library.points("egg").unit == "m"


def test_what_follows_the_unit_of_a_model_is_no_unit(tmp_path):
    from simplexmesh.recognition.library.models import Model

    library = sm.ModelLibrary(tmp_path / "models.sml")
    library.add("egg", MM)
    ((_, model),) = library._read().models.items()
    assert Model.unpacked(model.packed()).unit == "mm"
    with pytest.raises(ValueError, match="invalid values"):
        Model.unpacked(model.packed() + b"m")
