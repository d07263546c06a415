"""Every public door with every shape that nobody means: a result or one sentence, no crash, no hang, no traceback.

Run with `make nightly`; ten minutes.
"""

from __future__ import annotations

import pytest

from tests.nightly import doors, fuzz


@pytest.fixture(scope="module")
def process(tmp_path_factory):
    with fuzz.reader(tmp_path_factory.mktemp("shapes"), [], seconds=300.0) as found:  # some compile
        yield found


@pytest.mark.nightly
@pytest.mark.parametrize("door", doors.DOORS)
def test_degenerate_shapes(process, door):
    wrong = {shape: found for shape in doors.shapes() if (found := process.wrong(f"{shape}|{door}"))}
    assert not wrong
