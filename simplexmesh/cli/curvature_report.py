"""The report of `simplexmesh curvature`: its numbers, and its table."""

from __future__ import annotations

from typing import Any

from simplexmesh.cli.report import table


def described(found: dict[str, Any]) -> dict[str, Any]:
    """Return the report of a surface's curvature."""
    curved, salient, samples = found["curvature"], found["salient"], found["samples"]
    faces = samples.faces
    return {
        "vertices": len(samples.points),
        "faces": 0 if faces is None else len(faces),
        "method": curved.method,
        "failed": int(curved.failed.sum()),
        **{name: _spread(getattr(curved, name)) for name in ("mean", "gauss", "k1", "k2")},
        "saliency": _spread(found["saliency"]),
        "classes": found["classes"].counts,
        "salient": [
            {"vertex": int(vertex), "point": point, "value": float(value), "persistence": float(above)}
            for vertex, point, value, above in zip(
                salient.vertices, salient.points.tolist(), salient.values, salient.persistence, strict=True
            )
        ],
        "threshold": salient.threshold,
    }


def _spread(values: Any) -> dict[str, float]:
    import numpy as np

    known = values[np.isfinite(values)]
    marks = np.percentile(known, [0, 5, 50, 95, 100]) if len(known) else np.full(5, np.nan)
    return dict(zip(("min", "p5", "median", "p95", "max"), marks.tolist(), strict=True))


def print_table(title: str, facts: dict[str, Any], unit: str) -> None:
    """Print the report as a table."""

    def summary(name: str, measure: str) -> str:
        low, middle, high = (facts[name][part] for part in ("p5", "median", "p95"))
        middle = 0.0 if abs(middle) < 1e-9 * max(abs(low), abs(high)) else middle  # rounding errors on planes
        return f"{middle:.4g}, 90 % between {low:.4g} and {high:.4g} {measure}".rstrip()

    count = facts["vertices"]
    kinds = ", ".join(f"{name} {number / count:.0%}" for name, number in facts["classes"].items())
    table(
        title,
        {
            "surface": f"{count:,} vertices, {facts['faces']:,} faces",
            "method": facts["method"] + (f", failed at {facts['failed']:,} vertices" if facts["failed"] else ""),
            "mean H": summary("mean", per_unit(unit, 1)),
            "Gauss K": summary("gauss", per_unit(unit, 2)),
            "saliency": summary("saliency", "rad"),
            "types": kinds,
            "salient": _places(facts["salient"], unit),
            "time": f"{facts['seconds']:.1f} s",
        },
    )


def per_unit(unit: str, power: int) -> str:
    """Return the unit of a curvature, empty where the unit of length is unknown."""
    return {1: f"1/{unit}", 2: f"1/{unit}²"}.get(power, "") if unit else ""


def _places(salient: list[dict[str, Any]], unit: str) -> str:
    """Return a table of the salient points, one line each, with a header."""
    if not salient:
        return "none"
    place, size = f"z {unit}".rstrip(), f"|H| {per_unit(unit, 1)}".rstrip()
    wide, wider = max(10, len(place) + 9), max(10, len(size) + 5)
    lines = [f"{'x':>10} {'y':>10} {place:>{wide}} {size:>{wider}}"]
    for each in salient:
        x, y, z = (f"{value:.5g}" for value in each["point"])
        lines.append(f"{x:>10} {y:>10} {z:>{wide}} {each['value']:>{wider}.4g}")
    return "\n".join(lines)
