"""Run the bench and write its tables and two of its pictures into benchmark.md: `python docs/benchmark.py`."""

import os
import sys
from pathlib import Path

os.environ["PYVISTA_OFF_SCREEN"] = "true"

import benchmark_tables as tables
from benchmark_charts import colors, convergence

from simplexmesh.bench.run import measured
from simplexmesh.bench.trials import candidates, ratings
from simplexmesh.bench.truth.graphs import ARTICLE
from simplexmesh.plot.stage import picture

DOCS = Path(__file__).parent
PAGE = DOCS / "benchmark.md"
COLUMNS = ("2.5k", "10k", "41k", "10k, 1 %", "10k, 10 %", "41k, 10 %", "ellipsoid 10k, 10 %")


def filled(text, name, content):
    """The page with what stands between the marks of a name replaced."""
    start, end = f"<!-- bench: {name} -->", "<!-- end -->"
    head, _, rest = text.partition(start)
    _, _, tail = rest.partition(end)
    if not tail:
        raise ValueError(f"{PAGE.name} must have {start} and then {end}")
    return f"{head}{start}\n{content}\n{end}{tail}"


def main():
    names = {kind: list(registry) for kind, registry in candidates.REGISTRIES.items()}
    found = measured(list(ARTICLE.values()), names, lambda share, what: print(f"{share:.0%} {what}"))
    contents = {"rules": ratings.RULES, "borders": tables.borders(found.border)}
    for kind, rows in found.ratings.items():
        contents[f"ratings of {kind}"] = tables.ratings(kind, rows)
    for quantity in "HKN":
        columns = ("regular 10k", *COLUMNS) if quantity == "H" else COLUMNS
        contents[f"tori {quantity}"] = tables.tori([row for row in found.tori if row["case"] in columns], quantity)
    contents |= {f"tilts {quantity}": tables.tilts(found.tilts, quantity) for quantity in "HN"}
    text = PAGE.read_text(encoding="utf-8")
    for name, content in contents.items():
        text = filled(text, name, content)
    picture(DOCS / "images" / "bench_curves.png", convergence(found.curves["curvature"]))
    picture(DOCS / "images" / "bench_colors.png", colors(names["curvature"]))
    PAGE.write_text(text, encoding="utf-8")
    print(f"written: {PAGE}")


if __name__ == "__main__":
    sys.exit(main())
