"""Progress: a bar titled by what is done, a function of the caller's, or nothing."""

from __future__ import annotations

import inspect
from functools import partial
from types import SimpleNamespace

import pytest
from rich.console import Console

import simplexmesh as sm
from simplexmesh._base import progress
from simplexmesh._base.progress import bar_reporting, reporting

DONE = "a title"
TAKERS = [name for name in sm.__all__ if "progress" in getattr(getattr(sm, name), "__annotations__", {})]


def test_a_bar_says_what_is_done_and_how_far():
    told = []
    bar = SimpleNamespace(add_task=lambda title, total: told.append(title), update=lambda task, **now: told.append(now))
    with bar_reporting(bar, DONE) as report:
        report(0.5, "reading")
    assert told == [DONE, {"completed": 0.5, "description": f"{DONE}: reading"}]


@pytest.mark.filterwarnings('ignore:install "ipywidgets"')
@pytest.mark.parametrize("notebook", [False, True])
def test_true_draws_a_bar_with_the_title_that_stays_in_a_notebook_and_false_none(notebook, monkeypatch):
    bars = []

    def drawn(bar, title):
        bars.append((title, not bar.live.transient))
        return bar_reporting(bar, title)

    monkeypatch.setattr(progress, "bar_reporting", drawn)
    monkeypatch.setattr("rich.console.Console", partial(Console, force_jupyter=notebook))
    for wanted in (False, True):
        with reporting(wanted, DONE) as report:
            report(1.0, "done")
    assert bars == [(DONE, notebook)]


def test_a_function_is_called_itself():
    with reporting(print, DONE) as report:
        assert report is print


@pytest.mark.parametrize("wrong", ["x", 3, None])
@pytest.mark.parametrize("name", TAKERS)
def test_anything_else_is_refused_wherever_progress_is_shown(name, wrong):
    ball = sm.sphere(6).vertices
    needed = [
        each.name for each in inspect.signature(getattr(sm, name)).parameters.values() if each.default is each.empty
    ]
    data = {"scans": [ball, ball]}
    assert len(TAKERS) >= 6
    with pytest.raises(TypeError, match=r"^progress must be true or false"):
        getattr(sm, name)(*(data.get(each, ball) for each in needed), progress=wrong)


def test_a_library_refuses_it_too(tmp_path):
    with pytest.raises(TypeError, match=r"^progress must be true or false"):
        sm.ModelLibrary(tmp_path / "models.sml").recognize(sm.sphere(6), progress="x")
