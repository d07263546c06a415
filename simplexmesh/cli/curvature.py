"""`simplexmesh curvature`: curvature, saliency, surface types and salient points of a surface or point cloud."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from simplexmesh.cli import report

EXAMPLE = "Example: simplexmesh curvature femur.off --method sine --rings 2 -o femur_curv.vtp --picture femur.png"
SHOWN = ("mean", "gauss", "k1", "k2", "saliency", "classes", "all")
POWERS = {"mean": -1, "gauss": -2, "k1": -1, "k2": -1}


def command(
    path: Annotated[Path, typer.Argument(metavar="INPUT", help="A surface, a model, or points.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="File to write the surface and all results to, .vtp.")
    ] = None,
    method: Annotated[
        str | None, typer.Option(help="Estimator, as in sm.curvature; the default chooses its own scale.")
    ] = None,
    rings: Annotated[
        int | None, typer.Option(help="Neighborhood of the method: all vertices within so many edges,")
    ] = None,
    radius: Annotated[float | None, typer.Option(help="or all within a distance, in the unit of the file,")] = None,
    nearest: Annotated[int | None, typer.Option(help="or so many nearest points.")] = None,
    points: Annotated[int, typer.Option(help="Number of salient points to report.")] = 10,
    picture: report.Picture = None,
    show: Annotated[
        str | None, typer.Option(help="What it shows: mean (the default), gauss, k1, k2, saliency, classes or all.")
    ] = None,
    limits: Annotated[tuple[float, float] | None, typer.Option(help="Ends of its color scale.")] = None,
    unit: report.Unit = "",
    flip: Annotated[bool, typer.Option("--flip", help="Reverse faces or normals that point inward.")] = False,
    side: report.View = "iso",
    up: report.Up = "auto",
    json: report.Json = False,
) -> int | str:
    """Estimate curvature, saliency, surface types and salient points of a surface or point cloud."""
    output = output and report.writable(output, "--output", (".vtp",), [path])
    picture = picture and report.writable(picture, "--picture", report.PICTURES, [path])
    _check_options(method, {"--rings": rings, "--radius": radius, "--nearest": nearest}, points)
    _check_picture(picture, show, limits)
    camera = report.camera(side, up, drawn=picture is not None)

    with report.work("measuring", wanted=not json) as (interrupts, reported):
        began = time.perf_counter()
        reported(0.0, "reading")
        surface = _outward(_surface(path), flip=flip)
        reported(0.2, "curvature")
        found = measured(surface, method, _neighborhood(rings, radius, nearest), points, reported)
        seconds = time.perf_counter() - began
        facts = described(found) | {"faces": getattr(surface, "n_faces", 0)}
        facts |= {"seconds": round(seconds, 3), "output": output and str(output)}
        interrupts.check()
        if output is not None:
            reported(0.8, "writing")
            with report.written_to(output, "the surface"):
                surface.with_data(**arrays(found)).save(output)
        if interrupts.pending and output is not None and picture is not None:
            report.note(f"interrupted; {output} was written, {picture} was not")
            return report.KEPT
        if picture is not None:
            reported(0.9, "drawing")
        view = {"title": path.name} | camera
        report.draw(picture, lambda plot: _drawn(plot, surface, found, show or SHOWN[0], limits, unit, **view))
    report.tell(facts, str(output or path), _rows(facts, unit), json=json)
    return 0


def _check_options(method: str | None, around: dict[str, Any], points: int) -> None:
    """Refuse options that exclude each other, before any work."""
    given = [name for name, value in around.items() if value is not None]
    if len(given) > 1:
        raise ValueError("give one of --rings, --radius and --nearest, not several")
    if given and method in (None, "adaptive"):
        wanted = "a --method with a neighborhood, such as sine"
        raise ValueError(f"{given[0]} needs {wanted}: adaptive, the default, chooses its own")
    if points < 0:
        raise ValueError(f"--points must be at least 0, not {points}")


def _check_picture(picture: Path | None, show: str | None, limits: tuple[float, float] | None) -> None:
    """Refuse options that do not fit the picture, or that need one."""
    if show is not None:
        from simplexmesh._base import checks

        checks.choice("--show", show, SHOWN)
    if limits is not None and not (math.isfinite(limits[0]) and math.isfinite(limits[1])):
        raise ValueError(f"--limits must be finite, not {limits[0]:g} and {limits[1]:g}")
    if limits is not None and not limits[0] < limits[1]:
        raise ValueError(f"--limits must increase, not go from {limits[0]:g} to {limits[1]:g}")
    if picture is None and (show is not None or limits is not None):
        raise ValueError(f"{'--show needs' if show is not None else '--limits need'} --picture")
    if show in ("classes", "all") and limits is not None:
        has = "none" if show == "classes" else "several"
        raise ValueError(f"--limits are the ends of one color scale, --show {show} has {has}")


def _surface(path: Path) -> Any:
    """Return the contents of a file; volumes are refused."""
    from simplexmesh.data.io.reading import read
    from simplexmesh.data.volume import Volume

    found = read(path)
    if isinstance(found, Volume):
        hint = "use simplexmesh reconstruct to make a model of it"
        raise ValueError(f"INPUT must hold a surface or points, {path.name} holds a volume: {hint}")
    return found


def _outward(surface: Any, *, flip: bool) -> Any:
    """Return the surface, reversed if `flip`."""
    from simplexmesh.data.points import PointCloud
    from simplexmesh.data.triangles import TriangleMesh

    if isinstance(surface, TriangleMesh):
        surface = replace(surface, faces=surface.faces[:, ::-1]) if flip else surface
    elif flip and isinstance(surface, PointCloud) and surface.normals is not None:
        surface = replace(surface, normals=-surface.normals)
    elif flip:
        raise ValueError("--flip reverses triangles and the normals of points, INPUT has neither")
    return surface


def _neighborhood(rings: int | None, radius: float | None, nearest: int | None) -> Any:
    from simplexmesh.surface import neighborhoods

    if rings is not None:
        return neighborhoods.rings(rings)
    if radius is not None:
        return neighborhoods.ball(radius)
    return None if nearest is None else neighborhoods.nearest(nearest)


def measured(surface: Any, method: str | None, neighborhood: Any, points: int, reported: Any) -> dict[str, Any]:
    """Return curvature, saliency, classes and salient points of a surface, by name."""
    from simplexmesh.surface.curvature.estimate import curvature
    from simplexmesh.surface.saliency.hk_classes import hk_classes
    from simplexmesh.surface.saliency.saliency import saliency
    from simplexmesh.surface.saliency.salient_points import salient_points
    from simplexmesh.surface.sampled_surface import as_sampled_surface

    samples = as_sampled_surface(surface)
    how = {} if neighborhood is None else {"neighborhood": neighborhood}
    found = curvature(samples, **how) if method is None else curvature(samples, method, **how)
    reported(0.5, "saliency")
    standing = saliency(samples, curvature=found)
    kinds = hk_classes(samples, curvature=found)
    salient = salient_points(samples, curvature=found, count=points)
    return {"samples": samples, "curvature": found, "saliency": standing, "classes": kinds, "salient": salient}


def arrays(found: dict[str, Any]) -> dict[str, Any]:
    """Return the per-vertex arrays of the file by name, without those that the method does not estimate."""
    curved = found["curvature"]
    named = ("k1", "k2", "mean", "gauss", "d1", "d2", "normals", "failed", "error")
    known = {name: getattr(curved, name) for name in named if getattr(curved, name) is not None}
    return known | {"saliency": found["saliency"], "hk_class": found["classes"].labels}


def _drawn(plot: Any, surface: Any, found: dict[str, Any], show: str, limits: Any, unit: str, **options: Any) -> Any:
    """Return the plotter of what is to be shown; the options are the title and the view."""
    from simplexmesh.plot.color_scale import titled

    if show == "all":
        curved, points = found["curvature"], len(found["salient"])
        return plot.curvature(surface, curvature=curved, count=points, unit=unit, **options)
    if show == "classes":
        return plot.classes(surface, found["classes"], **options)
    values = found["saliency"] if show == "saliency" else getattr(found["curvature"], show)
    name = {"mean": "mean curvature", "gauss": "Gaussian curvature", "saliency": "saliency (rad)"}.get(show, show)
    return plot.heat(surface, values, name=titled(name, unit, POWERS.get(show, 0)), limits=limits, **options)


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


def _rows(facts: dict[str, Any], unit: str) -> dict[str, str]:
    """Return the rows of the table."""
    from simplexmesh._base.units import power_of_unit

    def summary(name: str, measure: str) -> str:
        low, middle, high = (facts[name][part] for part in ("p5", "median", "p95"))
        middle = 0.0 if abs(middle) < 1e-9 * max(abs(low), abs(high)) else middle  # rounding errors on planes
        return f"{middle:.4g}, 90 % between {low:.4g} and {high:.4g} {measure}".rstrip()

    count = facts["vertices"]
    return {
        "surface": f"{count:,} vertices, {facts['faces']:,} faces",
        "method": facts["method"] + (f", failed at {facts['failed']:,} vertices" if facts["failed"] else ""),
        "mean H": summary("mean", power_of_unit(unit, -1)),
        "Gauss K": summary("gauss", power_of_unit(unit, -2)),
        "saliency": summary("saliency", "rad"),
        "types": ", ".join(f"{name} {number / count:.0%}" for name, number in facts["classes"].items()),
        "salient": _places(facts["salient"], unit),
        "time": f"{facts['seconds']:.1f} s",
    }


def _places(salient: list[dict[str, Any]], unit: str) -> str:
    """Return a table of the salient points."""
    from simplexmesh._base.units import power_of_unit

    if not salient:
        return "none"
    titles = ("x", "y", f"z {unit}".rstrip(), f"|H| {power_of_unit(unit, -1)}".rstrip())
    rows = [[*(f"{x:.5g}" for x in each["point"]), f"{each['value']:.4g}"] for each in salient]
    return report.columns(titles, rows, most=len(rows))
