"""Figures in the README and the documentation are those that benchmarks printed and stored.

A row of a table is found by how it begins. Of each figure behind its first cell, in order, `ROWS` says where it is
stored; a single number is the mean of the stored values, "a to b" their least and most. `python
tests/benchmarks/bench_NAME.py --store` measures anew; then the pages must follow.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from simplexmesh.bench.trials.published import OTHERS
from tests.benchmarks.figures import RESULTS, stored

REPOSITORY = Path(__file__).parents[1]
NUMBER = r"(?:\d[\d,]*(?:\.\d+)?|\.\d+)"
FIGURE = re.compile(rf"(?<![\w.])({NUMBER})(?: to ({NUMBER}))?")


def row_of(page, start):
    """The one row of a page's tables that begins so."""
    found = [line for line in page.splitlines() if line.startswith(f"| {start}")]
    assert len(found) == 1, f"{len(found)} rows begin with {start!r}"
    return found[0]


def differences(row, places):
    """What a row says otherwise than is stored at places, `benchmark: figure` each; empty where all agrees."""
    cells = row.strip().strip("|").split("|", 1)[1]
    shown = FIGURE.findall(cells)
    if len(shown) != len(places):
        return [f"{len(shown)} figures for {len(places)} places: {shown}"]
    out = []
    for (first, last), place in zip(shown, places, strict=True):
        name, key = place.split(": ", 1)
        values = stored(name)["figures"][key]["values"]
        known = (min(values), max(values)) if last else (sum(values) / len(values),)
        out += [f"{text} for {value:.6g}, {place}" for text, value in zip((first, last), known, strict=False)
                if not rounded(text, value)]  # fmt: skip
    return out


def rounded(text, value):
    """Whether a printed number is a value rounded to its last digit."""
    digits = len(text.partition(".")[2])
    return abs(float(text.replace(",", "")) - value) <= 0.5 * 10.0**-digits + 1e-5 * abs(value)


def test_a_wrong_figure_is_found():
    places = ["motion: whole step, 980 vertices, one thread", "quoted: ITK, whole step, 980 vertices, one thread"]
    ours, theirs = (stored(*place.split(": ")[:1])["figures"][place.split(": ", 1)[1]]["values"] for place in places)
    good = f"| a row of 3 | {sum(ours) / len(ours):.0f} ns | {min(theirs):,} to {max(theirs):,} ns (ITK) |"
    assert differences(good, places) == []
    assert differences(good.replace(f" {max(theirs):,} ", f" {max(theirs) + 1:,} "), places)
    assert differences(good.replace(" ns |", "1 ns |", 1), places)
    assert differences(good.replace("(ITK)", "(ITK 5)"), places)


@pytest.mark.parametrize(("page", "start", "places"), [(*key, places) for key, places in ROWS.items()])
def test_the_rows_of_the_pages(page, start, places):
    assert differences(row_of((REPOSITORY / page).read_text(encoding="utf-8"), start), places) == []


def test_every_row_of_the_readme_is_compared():
    text = (REPOSITORY / "README.md").read_text(encoding="utf-8")
    table = text.split("## Accuracy and speed")[1].split("\n\n")[1].splitlines()[2:]
    starts = [start for page, start in ROWS if page == "README.md"]
    assert len(table) == len(starts)
    assert all(any(row.startswith(f"| {start}") for start in starts) for row in table)


def test_programs_of_the_benchmark_page_are_as_measured():
    """`published.OTHERS` has means, in two digits at least."""
    columns = ("2.5k", "10k", "41k")
    titles = ("regular, clean", "irregular, clean", "irregular, 1 % of an edge", "irregular, 10 % of an edge")
    keys = [f"{title}, {size}" for title in titles for size in columns] + ["irregular, 1 % of the diagonal, 10k"]
    for program, values in OTHERS.items():
        for key, value in zip(keys, values, strict=True):
            known = stored("adaptive")["figures"][f"{key}, {program}, H"]["values"]
            assert value == pytest.approx(sum(known) / len(known), rel=0.06), (program, key)


def test_what_is_stored_says_how_it_was_measured():
    for path in RESULTS.glob("*.json"):
        told = json.loads(path.read_text(encoding="utf-8"))
        assert told["protocol"]
        assert all(figure["values"] for figure in told["figures"].values())
        if path.stem == "quoted":
            assert all(figure["source"] and figure["protocol"] for figure in told["figures"].values())
        else:
            assert (Path(__file__).parent / "benchmarks" / told["benchmark"]).exists()
            assert told["machine"] == "two cores"


def test_what_is_quoted_is_called_so():
    for (page, start), places in ROWS.items():
        if any(place.startswith("quoted: ") for place in places):
            assert "quoted" in row_of((REPOSITORY / page).read_text(encoding="utf-8"), start)
