"""Files are complete or as they were."""

from __future__ import annotations

import os
import stat
from concurrent.futures import ThreadPoolExecutor

import pytest

from simplexmesh._base.drafts import draft


def test_errors_and_interrupts_leave_the_file_as_it_was(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("before")

    def write(error):
        with draft(path) as part:
            part.write_text("half")
            raise error

    for error in (ValueError, KeyboardInterrupt):
        with pytest.raises(error):
            write(error)
        assert path.read_text() == "before"
        assert list(tmp_path.iterdir()) == [path]


@pytest.mark.skipif(os.name == "nt", reason="permissions and links are those of POSIX")
def test_links_and_permissions_are_kept(tmp_path):
    path, link = tmp_path / "a.txt", tmp_path / "b.txt"
    path.write_text("before")
    path.chmod(0o640)
    link.symlink_to(path)
    with draft(link) as part:
        part.write_text("after")
    assert link.is_symlink()
    assert path.read_text() == "after"
    assert stat.S_IMODE(path.stat().st_mode) == 0o640


def test_errors_name_the_file_asked_for(tmp_path):
    path = tmp_path / "a.txt"
    with pytest.raises(OSError, match=r"a\.txt'$") as caught, draft(path) as part:
        raise PermissionError(13, "Permission denied", str(part))
    assert caught.value.errno == 13
    for missing in (tmp_path / "no" / "a.txt", tmp_path):
        with pytest.raises(OSError, match="path must be"), draft(missing):
            pass


def test_drafts_have_names_of_their_own_and_follow_no_link(tmp_path, monkeypatch):
    path, other = tmp_path / "a.txt", tmp_path / "other"
    with draft(path) as first, draft(path) as second:
        assert first != second
        assert first.parent == second.parent == tmp_path
        first.write_text("first")
        second.write_text("second")
    assert path.read_text() == "first"
    monkeypatch.setattr("secrets.token_hex", lambda n: "0" * 2 * n)
    with draft(path) as part:
        part.write_text("again")
        name = part.name
    (tmp_path / name).symlink_to(other)
    with pytest.raises(FileExistsError), draft(path):
        pass
    assert not other.exists()
    assert path.read_text() == "again"


def test_threads_that_write_one_file(tmp_path):
    path = tmp_path / "a.txt"
    texts = [str(k) * 100_000 for k in range(8)]

    def write(text):
        for _ in range(5):
            with draft(path) as part:
                part.write_text(text)
            assert path.read_text() in texts

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(write, texts))
    assert path.read_text() in texts
    assert list(tmp_path.iterdir()) == [path]


def test_content_is_on_disk_before_the_name(tmp_path, monkeypatch):
    calls = []
    fsync, replace = os.fsync, os.replace
    monkeypatch.setattr(os, "fsync", lambda handle: (calls.append("fsync"), fsync(handle)))
    monkeypatch.setattr(os, "replace", lambda *paths: (calls.append("replace"), replace(*paths)))
    with draft(tmp_path / "a.txt") as part:
        part.write_text("after")
    assert calls == ["fsync", "replace"]


def test_a_writer_that_wrote_nothing(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("before")
    with pytest.raises(OSError, match="nothing was written"), draft(path):
        pass
    assert path.read_text() == "before"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.skipif(os.name == "nt", reason="without locks drafts are swept after a day")
def test_drafts_of_killed_processes_are_swept(tmp_path):
    path = tmp_path / "a.txt"
    left, another = (tmp_path / f".part-{'0' * 16}.{name}" for name in ("a.txt", "b.txt"))
    for file in (left, another):
        file.write_text("half")
        os.utime(file, (0, 0))
    with draft(path) as used:
        used.write_text("first")
        os.utime(used, (0, 0))
        with draft(path) as part:
            part.write_text("second")
        assert used.exists()
    assert path.read_text() == "first"
    assert {file.name for file in tmp_path.iterdir()} == {"a.txt", another.name}
