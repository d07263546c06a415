"""Figures in the README and the documentation are those that benchmarks printed and stored.

A row of a table is found by how it begins. Of each figure behind its first cell, in order, `ROWS` says where it is
stored; a single number is the mean of the stored values, "a to b" their least and most. `python
tests/benchmarks/bench_NAME.py --store` measures anew; then the pages must follow.
"""

from __future__ import annotations

import json
import re
from datetime import date
from pathlib import Path

import pytest

from simplexmesh.bench.trials.published import OTHERS
from tests.benchmarks.figures import RESULTS, stored

REPOSITORY = Path(__file__).parents[1]
NUMBER = r"(?:\d[\d,]*(?:\.\d+)?|\.\d+)"
FIGURE = re.compile(rf"(?<![\w.])({NUMBER})(?: to ({NUMBER}))?")

README, CURVATURE, RECOGNITION = "README.md", "docs/curvature.md", "docs/recognition.md"
PROGRAMS = {
    "cotangents + angle defect": "libigl, cotangents and angle defect",
    "VTK": "VTK",
    "robust_laplacian": "robust_laplacian",
    "pymeshlab, quadric": "PyMeshLab, quadric fitting",
    "pymeshlab, APSS": "PyMeshLab, APSS",
    "igl `principal_curvature`, radius 3": "libigl, quadrics, 3 rings",
    "igl `principal_curvature`, radius 5": "libigl, quadrics, 5 rings",
    "pymeshlab, scale-dependent quadric": "PyMeshLab, quadrics at 10 %",
    "trimesh": "trimesh, ball measures",
}
COLUMNS = [
    *(f"{title}, {size}"
      for title in ("regular, clean", "irregular, clean", "irregular, 1 % of an edge", "irregular, 10 % of an edge")
      for size in ("2.5k", "10k", "41k")),
    "irregular, 1 % of the diagonal, 10k",
]  # fmt: skip


def quality(case, *programs):
    """Distance, then normals, of each program."""
    return [f"quality: {case}, {program}, {what}" for program in programs for what in ("distance", "normals")]


def registration(case):
    """Rates, and errors where the page has them."""
    methods = {"register": 2, "Open3D RANSAC": 1, "Open3D RANSAC, ICP": 2, "Open3D RANSAC, small_gicp": 2}
    whats = ("found", "median error")
    return [f"register_peers: {case}, {method}, {what}" for method, most in methods.items() for what in whats[:most]]


def decimation(name):
    """Ours, and each peer by both counts."""
    places = [f"decimate: {name}, decimate, {what}" for what in ("to the new surface", "back")]
    rows = {f"{name}, `decimate`": places}
    for peer, shown in (("igl.qslim", "libigl `qslim`"), ("VTK quadrics", "VTK quadrics")):
        for count in ("as many triangles", "as many vertices"):
            whats = ("time over ours", "to the new surface", "back")
            rows[f"{name}, {shown}, {count}"] = [f"decimate: {name}, {peer}, {count}, {what}" for what in whats]
    return {("docs/operators.md", start): places for start, places in rows.items()}


HALVES = "bunny 0.5, 0.5, 0.5 %"
BODIES = {"whole, 0.2 %": "100% seen, 0.2%", "whole, 1 %": "100% seen, 1.0%", "70 % seen, 0.5 %": "70% seen, 0.5%",
          "50 % seen, 0.5 %": "50% seen, 0.5%", "35 % seen, 0.5 %": "35% seen, 0.5%"}  # fmt: skip
NOISY, MASK = "quality: torus points, 1 % noise", "quality: torus mask, 64 samples"
ROWS = {
    (README, "torus from 20,000 points"): [
        f"{NOISY}, simplexmesh, distance",
        f"{NOISY}, CGAL Poisson, distance",
        f"{NOISY}, Open3D Poisson, best depth, distance",
    ],
    (README, "torus from a 0/1 mask"): [
        f"{MASK}, {who}, {what}" for who in ("simplexmesh", "windowed sinc") for what in ("distance", "normals")
    ],
    (README, "head CT"): ["reconstruct: head CT, level 500, 3,000 vertices, processor time"],
    (README, "six bunny scans"): ["reconstruct: six bunny scans, 4,000 vertices, processor time"],
    (README, "internal force"): [
        f"motion: {what}, 9,680 vertices, one thread" for what in ("internal force", "windowed sinc")
    ],
    (README, "the whole step"): [
        "motion: whole step, 9,680 vertices, one thread",
        "quoted: ITK, whole step, 9,680 vertices, one thread",
    ],
    (README, "registration of half"): [
        f"register_peers: {HALVES}, {who}, found" for who in ("register", "Open3D RANSAC, ICP", "KISS-Matcher, ICP")
    ],
    (README, "recognition among"): [
        f"recognize: 13 bodies, 50% seen, 0.5%, {who}first" for who in ("", "Open3D mean FPFH, ")
    ],
    (README, "mean curvature of"): [
        f"adaptive: irregular, clean, 10k, {who}, H" for who in ("adaptive", "PyMeshLab, quadric fitting")
    ],
    (README, "the same with noise of 1 %"): [
        f"adaptive: irregular, 1 % of an edge, 10k, {who}, H" for who in ("adaptive", "PyMeshLab, APSS")
    ],
    (README, "the same with noise of 10 %"): [
        f"adaptive: irregular, 10 % of an edge, 10k, {who}, H" for who in ("adaptive", "PyMeshLab, quadrics at 10 %")
    ],
    ("docs/reconstruction.md", "0.2 % noise"): quality(
        "torus points, 0.2 % noise", "simplexmesh", "PyMeshLab APSS", "Open3D Poisson, best depth"
    ),
    ("docs/reconstruction.md", "1 % noise"): quality(
        "torus points, 1 % noise", "simplexmesh", "CGAL Poisson", "Open3D Poisson, best depth"
    ),
    **{
        ("docs/reconstruction.md", f"{shape}, {size}"): quality(f"{shape} mask, {size} samples", *both)
        for shape in ("torus", "ellipsoid")
        for size in (64, 128)
        for both in (("simplexmesh", "windowed sinc"),)
    },
    **{
        ("docs/reconstruction.md", f"{body} |"): [
            f"against_meshers: {body}, {noise} % noise, {who}, {what}"
            for noise in ("0", "0.2", "0.5", "1")
            for who in ("simplexmesh", "best peer")
            for what in ("mean", "normals")
        ]
        for body in (
            "spot",
            "elephant",
            "lion_head",
            "femur",
            "knot1",
            "eight",
            "animal",
            "hand",
            "blobs",
            "knot",
            "relief",
            "casting",
            "rings",
        )
    },
    **{
        ("docs/motion.md", f"{count} vertices, one thread"): [
            f"motion: {what}, {count} vertices, one thread"
            for what in ("internal force", "windowed sinc", "whole step")
        ]
        + [f"quoted: ITK, whole step, {count} vertices, one thread"]
        for count in ("980", "9,680", "79,380")
    },
    (CURVATURE, "**`sm.curvature(mesh)`**"): [f"adaptive: {column}, adaptive, H" for column in COLUMNS],
    (CURVATURE, "meshlib, quoted"): [f"quoted: {column}, meshlib, H" for column in COLUMNS],
    **{
        (CURVATURE, start): [f"adaptive: {column}, {program}, H" for column in COLUMNS]
        for start, program in PROGRAMS.items()
    },
    **{
        (RECOGNITION, f"{case} |"): registration(case)
        for case in (
            "bunny 1, 1, 0.2 %",
            "bunny 1, 1, 1 %",
            "bunny 1, 0.7, 0.5 %",
            "bunny 1, 0.35, 0.5 %",
            "bunny 0.7, 0.7, 0.5 %",
            HALVES,
            "ant 1, 1, 0.2 %",
            "ant 1, 0.5, 0.5 %",
            "ant 0.7, 0.7, 0.5 %",
            "bun045 on bun000",
        )
    },
    **{
        (RECOGNITION, start): [
            f"recognize: 13 bodies, {row}, {what}"
            for what in (
                "first",
                "median error",
                "histogram of distances, first",
                "Open3D mean FPFH, first",
                "trimesh identifier of the hull, first",
            )
        ]
        for start, row in BODIES.items()
    },
    **{
        (RECOGNITION, f"one view{which}"): [
            f"recognize: 13 bodies, one view, {noise}, {what}" for what in ("first", "median error")
        ]
        for which, noise in ((" (a quarter to a half), 0.2 %", "0.2%"), (", 0.5 %", "0.5%"))
    },
    **{
        (RECOGNITION, f"of 510, {start}"): [
            f"recognize: 510 models, {row}, {what}" for what in ("first", "among five", "median error")
        ]
        for start, row in {"whole": "100% seen, 1.0%", "70 %": "70% seen, 0.5%", "50 %": "50% seen, 0.5%"}.items()
    },
    **{
        ("docs/operators.md", f"{name}, {count} vertices, within {most} %"): [
            f"decimate: {name}, {count} vertices, within {most} %, left",
            f"decimate: {name}, within {most} %, largest",
        ]
        for name, count, most in (("coupling", "3,714", "1"), ("fandisk", "12,946", "1"), ("elephant", "5,558", "0.5"))
    },
    **decimation("head"),
    **decimation("fandisk"),
    **decimation("elephant"),
}


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
            assert date.fromisoformat(told["last run"]["day"])
            assert told["last run"]["commit"]


def test_what_is_quoted_is_called_so():
    for (page, start), places in ROWS.items():
        if any(place.startswith("quoted: ") for place in places):
            assert "quoted" in row_of((REPOSITORY / page).read_text(encoding="utf-8"), start)
