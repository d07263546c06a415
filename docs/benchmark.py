"""Run the bench and write its tables and two of its pictures into benchmark.md: `python docs/benchmark.py`."""

import os
import sys
from pathlib import Path

os.environ["PYVISTA_OFF_SCREEN"] = "true"

from simplexmesh.surface.bench import candidates, page, peers, pictures, published, ratings, tables
from simplexmesh.surface.bench.run import measured
from simplexmesh.surface.truth.graphs import ARTICLE

DOCS = Path(__file__).parent
PAGE = DOCS / "benchmark.md"
RATED = ("precision", "convergence", "stability", "clouds")
COLUMNS = ("regular 10k", "2.5k", "10k", "41k", "10k, 1 %", "10k, 10 %", "41k, 10 %", "ellipsoid 10k, 10 %")
SHOWN = {"pointwise_H_cubic_6": "bench_curves", "map_H_monkey_saddle": "bench_colors"}


def rating_table(kind, rows):
    """Our ratings, and where the thesis has other ones, those after a slash."""
    lines = []
    for row in rows:
        theirs = dict(zip(published.CRITERIA, published.THESIS[kind].get(row["method"], ("",) * 6)[1:], strict=True))
        cells = {}
        for name in RATED:
            ours, other = tables.formatted(row[name]), tables.formatted(theirs[name])
            cells[name] = f"{ours} (thesis {other})" if other and ours and other != ours else ours
        lines.append({"method": row["method"], **cells})
    return tables.as_markdown(lines)


def reasons(kind, rows):
    """Why ratings differ, one sentence each."""
    lines = [line for line in ratings.compared(kind, rows) if line["why"]]
    return tables.bullets(f"`{line['method']}`, {line['criterion']}: {line['why']}" for line in lines)


def torus_table(rows, quantity):
    """Errors on tori, those of other programs below."""
    titles = {case.title: page._column(case) for case in peers.CASES}
    lines = [line | {"column": titles[line["case"]]} for line in rows if line["quantity"] == quantity]
    table = tables.pivoted(lines, "method", "column", page.error_cell)
    if quantity == "H":
        table += page._other_programs(list(titles.values())[:13], list(table[0]))
    kept = [column for column in COLUMNS if quantity == "H" or column not in ("regular 10k",)]
    return tables.as_markdown(table, ["method", *kept])


def filled(text, name, content):
    """The page with what stands between the marks of a name replaced."""
    start, end = f"<!-- bench: {name} -->", "<!-- end -->"
    head, _, rest = text.partition(start)
    _, _, tail = rest.partition(end)
    if not tail:
        raise ValueError(f"{PAGE.name} must have {start} and then {end}")
    return f"{head}{start}\n{content}\n{end}{tail}"


def main():
    found = measured(list(ARTICLE.values()), candidates.named("all"), lambda share, what: print(f"{share:.0%} {what}"))
    text = PAGE.read_text(encoding="utf-8")
    for kind, rows in found.ratings.items():
        text = filled(text, f"ratings of {kind}", rating_table(kind, rows))
        text = filled(text, f"reasons for {kind}", reasons(kind, rows))
    for quantity in "HKN":
        text = filled(text, f"tori {quantity}", torus_table(found.peers, quantity))
    for quantity in "HN":
        lines = [line for line in found.tilts if line["quantity"] == quantity]
        table = tables.pivoted(lines, "method", "degrees", lambda line: float(line["error"]))
        text = filled(text, f"tilts {quantity}", tables.as_markdown(table))
    edge = tables.pivoted(found.border, "method", "noise", page.border_cell)
    text = filled(text, "borders", tables.as_markdown(edge))
    text = filled(text, "rules", ratings.RULES)
    made = [*pictures.of_curves(found.curves["curvature"], ("cubic",)), *pictures.of_surfaces(found.names, few=True)]
    for name, _, draw in made:
        if name in SHOWN:
            pictures.save(DOCS / "images" / f"{SHOWN[name]}.png", draw())
    PAGE.write_text(text, encoding="utf-8")
    print(f"written: {PAGE}")


if __name__ == "__main__":
    sys.exit(main())
