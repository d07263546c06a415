"""Files are complete or as they were."""

from __future__ import annotations

import os
import stat

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
