"""Every Python block of the README and the documentation runs on its own, as a reader who copies one would run it."""

from __future__ import annotations

import os
import re
import shlex
import warnings
from pathlib import Path

import pytest

import simplexmesh as sm
from simplexmesh.cli import app

REPOSITORY = Path(__file__).parents[1]
PAGES = [REPOSITORY / "README.md", *sorted((REPOSITORY / "docs").glob("**/*.md"))]
PAGES = [
    page for page in PAGES if page.name != "gallery.md" and "_build" not in page.parts
]  # that one is made of the demos
SKIPPED = "<!-- not run"
LONG = {"compare", "contours", "curvature", "data", "guides", "measure", "operators", "print"}
LONG |= {
    "coming",
    "features",
    "primitives",
    "recognition",
    "recognize",
    "reconstruction",
    "scans",
    "topology",
    "vertices",
}
"""Pages that run every night."""


def blocks(text, language):
    """The fenced blocks of a language with the line each begins at, those after `<!-- not run: why -->` left out."""
    found, kept, start, skip = [], None, 0, False
    for number, line in enumerate(text.splitlines(), 1):
        if kept is None and line.startswith("```"):
            kept, start, wanted = [], number + 1, line[3:].strip() == language and not skip
        elif kept is not None and line.startswith("```"):
            if wanted:
                found.append((start, "\n".join(kept)))
            kept, skip = None, False
        elif kept is not None:
            kept.append(line)
        elif line.strip():
            skip = line.startswith(SKIPPED)
    return found


def run(page, text):
    """Run each Python block of a page, with the page's own line numbers in tracebacks."""
    for line, source in blocks(text, "python"):
        exec(compile("\n" * (line - 1) + source, str(page), "exec"), {"__name__": "page"})


@pytest.mark.parametrize(
    "page",
    [pytest.param(page, marks=[pytest.mark.nightly] * (page.stem in LONG)) for page in PAGES],
    ids=lambda page: page.name,
)
def test_python_runs(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = page.read_text(encoding="utf-8")
    if "# data: " in text:
        folder = Path(os.environ.get("SIMPLEXMESH_DATA", "no data"))
        for name in re.findall(r"# data: (\S+)", text):
            if not (folder / name).exists():
                pytest.skip(f"{name} is not here")
            for part in folder.glob(f"{Path(name).stem}.*"):
                (tmp_path / part.name).symlink_to(part)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run(page, text)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_exist_as_written(page):
    """Each `simplexmesh ...` line of a shell block names a command and options there are."""
    commands = app.typer.main.get_command(app.app).commands
    for _, source in blocks(page.read_text(encoding="utf-8"), "sh"):
        for line in source.splitlines():
            words = shlex.split(line, comments=True)
            if words[:1] != ["simplexmesh"]:
                continue
            command, *words = words[1:]
            known = commands[command]
            if hasattr(known, "commands"):
                command, *words = words
                known = known.commands[command]
            known = {option for parameter in known.params for option in parameter.opts} | {"--help", "-z"}  # --up -z
            assert [word for word in words if re.match(r"--?[a-z]", word) and word not in known] == []


def test_a_failing_block_is_seen():
    with pytest.raises(AssertionError):
        run("page.md", "```python\nx = 1\n```\ntext\n```python\nx = 1\nassert x == 2\n```\n")
    with pytest.raises(NameError):
        run("page.md", "```python\nx = 1\n```\ntext\n```python\nassert x == 1\n```\n")


def test_marked_blocks_are_left_out():
    text = "```python\nx = 1\n```\n<!-- not run: needs a window -->\n```python\n1 / 0\n```\n```python\nx = 2\n```"
    assert [line for line, _ in blocks(text, "python")] == [2, 9]
    run("page.md", text)


def test_the_reference_has_every_public_name():
    text = (REPOSITORY / "docs" / "api.md").read_text(encoding="utf-8")
    missing = [
        name
        for name in sm.__all__
        if name not in {"__version__", "plot", "primitives", "targets"} and f":: simplexmesh.{name}\n" not in text
    ]
    assert missing == []
    assert all(f"simplexmesh.plot.{name}\n" in text for name in sm.plot.__all__ if name != "has_display")
    assert all(f":: simplexmesh.primitives.{name}\n" in text for name in sm.primitives.__all__)


def test_every_page_is_in_the_table_of_contents():
    text = (REPOSITORY / "docs" / "index.md").read_text(encoding="utf-8")
    listed = " ".join(re.findall(r"```\{toctree\}\n.*?\n\n(.*?)```", text, re.DOTALL)).split()
    pages = {page.relative_to(REPOSITORY / "docs").with_suffix("").as_posix() for page in PAGES[1:]}
    assert sorted([*pages - {"index"}, "gallery"]) == sorted(listed)  # each once


def test_pictures_of_the_readme_are_there_and_small():
    text = (REPOSITORY / "README.md").read_text(encoding="utf-8")
    pictures = re.findall(r"!\[.*?\]\((.*?)\)", text)
    assert pictures
    for name in pictures:
        assert (REPOSITORY / name).stat().st_size < 150_000
