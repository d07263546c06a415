"""150 mutations of a file of every variety, and of real ones: read, or refused in one sentence.

Run with `make nightly`; half an hour.
"""

from __future__ import annotations

import shutil

import pytest

from tests.nightly import fuzz, seeds

MUTATIONS = 150


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """A process, and the files of every variety."""
    folder = tmp_path_factory.mktemp("sound")
    files = {path.name: path for path in seeds.write(folder)}
    assert files.keys() == set(seeds.WRITTEN)
    with fuzz.reader(folder, [files[name] for name in ("mesh.vtp", "a.nii.gz", "mesh.ply")]) as process:
        yield process, files


@pytest.mark.nightly
@pytest.mark.parametrize("name", seeds.WRITTEN)
def test_written_files(written, name, tmp_path):
    process, files = written
    for companion in (files[name].with_suffix(ending) for ending in (".raw", ".img")):
        if companion.exists():
            shutil.copy(companion, tmp_path)
    assert fuzz.damage(files[name], tmp_path, MUTATIONS, process) == []


@pytest.mark.nightly
@pytest.mark.data
@pytest.mark.parametrize("name", seeds.REAL)
def test_real_files(written, data_folder, name, tmp_path):
    companion = (data_folder / name).with_suffix(".raw")
    if companion.exists():
        shutil.copy(companion, tmp_path)
    assert fuzz.damage(data_folder / name, tmp_path, MUTATIONS // 5, written[0]) == []
