"""The tables of benchmark.md: ratings, tori, tilted normals, borders."""

from simplexmesh.bench.trials import meshes
from simplexmesh.bench.trials.published import CRITERIA, OTHERS, THESIS


def ratings(kind, rows):
    """Our ratings and, where the thesis has other ones, those in brackets."""
    lines = []
    for row in rows:
        cells = {name: text(row[name]) for name in CRITERIA}
        for name, theirs in zip(CRITERIA, THESIS[kind].get(row["method"], ()), strict=False):
            if row[name] not in ("", theirs):
                cells[name] += f" (thesis {text(theirs)})"
        lines.append({"method": row["method"], **cells})
    return markdown(lines)


def tilts(rows, quantity):
    """The errors of a quantity by the tilt of the initial normal."""
    lines = [line for line in rows if line["quantity"] == quantity]
    return markdown(pivoted(lines, "degrees", lambda line: line["error"]))


def tori(rows, quantity):
    """The errors of a quantity on tori, of H also other programs'."""
    lines = [line for line in rows if line["quantity"] == quantity]
    table = pivoted(lines, "case", lambda line: partly(line["error"], line["failed"] / line["vertices"]))
    if quantity == "H":
        titles = [case.title for case in meshes.CASES]
        table += [{"method": f"*{name}*"} | dict(zip(titles, errors, strict=False)) for name, errors in OTHERS.items()]
    return markdown(table)


def borders(rows):
    """The errors inside and at the border by the noise."""
    return markdown(pivoted(rows, "noise", border))


def border(line):
    """The errors inside and at the border."""
    failed = line["failed at the border"]
    return f"{text(line['inside'])} / {'none' if failed == 1 else partly(line['border'], failed)}"


def partly(error, failed):
    """An error, with the share of vertices without an estimate."""
    return text(error) + (f" ({100 * failed:.0f} %)" if failed >= 0.005 else "")


def pivoted(rows, column, value):
    """A row for each method, with a cell for each value of a column, in order of appearance."""
    out = {}
    for line in rows:
        out.setdefault(line["method"], {"method": line["method"]})[str(line[column])] = value(line)
    return list(out.values())


def markdown(rows):
    """Rows as a table of Markdown, with the columns of the first."""
    names = list(rows[0])
    lines = ["| " + " | ".join(names) + " |", "|" + "---|" * len(names)]
    return "\n".join(lines + ["| " + " | ".join(text(row.get(name)) for name in names) + " |" for row in rows])


def text(value):
    """A cell: numbers to three digits, signs of ratings as code."""
    if isinstance(value, float | int):
        return "–" if value != value else f"{value:.3g}"
    word = str(value or "")
    return f"`{word}`" if word and set(word) <= set("+-/") else word
