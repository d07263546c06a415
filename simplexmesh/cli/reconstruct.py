"""`simplexmesh reconstruct`: fit a surface model to a volume, a scan or several scans."""

from __future__ import annotations

import time
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from simplexmesh._base.interrupts import deferred_interrupts
from simplexmesh._base.progress import Progress
from simplexmesh.cli import report

EXAMPLE = (
    "Examples: simplexmesh reconstruct head_ct.mhd --level 500 --vertices 3000 -o head.vtp ;  "
    "simplexmesh reconstruct bun000.ply bun045.ply bun090.ply --poses bun.conf -o bunny.vtp ;  "
    "simplexmesh reconstruct scans/*.ply --poses auto -o model.vtp ;  "
    "simplexmesh reconstruct face.vtk --init sphere --holes auto --refine fine -o face.vtp"
)


def command(
    inputs: Annotated[
        list[Path], typer.Argument(metavar="INPUT", help="A volume, a surface, points, or several scans.")
    ],
    output: report.Model,
    level: report.Level = None,
    label: report.Label = None,
    inside: report.Inside = "above",
    vertices: Annotated[int, typer.Option(help="Number of vertices of the model, kept within 10 %.")] = 4000,
    init: Annotated[
        str, typer.Option(help="Start: auto, sphere, ellipsoid, cylinder, plane, torus, or a .vtp file of a mesh.")
    ] = "auto",
    poses: Annotated[
        Path | None,
        typer.Option(
            help="File of the pose of each scan, such as bun.conf; auto finds them, none keeps the scans' frames."
        ),
    ] = None,
    components: Annotated[
        str, typer.Option(help="Pieces to keep: largest, all, or auto: all of a label, else the largest.")
    ] = "auto",
    tunnels: Annotated[
        float | None, typer.Option(help="Close tunnels narrower than this, in the unit of the data.")
    ] = None,
    iterations: Annotated[int, typer.Option(help="Largest number of iterations of the fine stage.")] = 500,
    holes: Annotated[str | None, typer.Option(help="Open holes where the data ends: auto or none.")] = None,
    handles: Annotated[str | None, typer.Option(help="Add handles where the data has them: auto or none.")] = None,
    refine: Annotated[
        str | None, typer.Option(help="Divide faces while fitting: none, auto, coarse, medium or fine.")
    ] = None,
    placement: Annotated[
        str | None, typer.Option(help="Spacing of vertices: adaptive (to curvature and distance) or even.")
    ] = None,
    creases: Annotated[str, typer.Option(help="Sharp edges of the data: auto finds them, none.")] = "auto",
    picture: report.Picture = None,
    view: report.View = "iso",
    up: report.Up = "auto",
    json: report.Json = False,
) -> int | str:
    """Fit a surface model to a volume, a label map, a scan or several scans."""
    output = report.writable(output, "--output", inputs=inputs)
    picture = picture and report.writable(picture, "--picture", report.PICTURES, inputs)
    camera = report.camera(view, up, drawn=picture is not None)

    with deferred_interrupts() as interrupts:
        from simplexmesh._base.progress import part_of
        from simplexmesh.motion.reconstruct.pipeline import reconstruct

        began = time.perf_counter()
        with report.progress("reconstructing", wanted=not json) as shown:
            options: dict[str, Any] = {
                "level": level, "label": label, "inside": inside, "vertices": vertices, "init": init,
                "components": components, "tunnels": tunnels, "iterations": iterations, "holes": holes,
                "handles": handles, "refine": refine, "placement": placement,
                "creases": creases,
            }  # fmt: skip
            checked = interrupts.checking(shown)
            data, found, begun = loaded(inputs, poses, options, checked)
            interrupts.check()
            result = reconstruct(data, **options, progress=part_of(checked, begun, 1.0))
        seconds = time.perf_counter() - began
        with report.written_to(output, "the model"):
            result.mesh.save(output)
        interrupted = result.interrupted or interrupts.pending
        facts = _reported(result, output, seconds, interrupted=interrupted) | _poses(found)
        if not interrupted:
            chosen = {"level": level, "label": label, "inside": inside}
            report.draw(picture, lambda plot: plot.beside(data, result.mesh, **chosen, **camera))
    report.tell(facts, str(output), _rows(facts), json=json)
    return report.KEPT if interrupted else 0


def loaded(inputs: list[Path], poses: Path | None, options: dict[str, Any], shown: Progress) -> tuple[Any, Any, float]:
    """Return the data, of several files joined points, the poses if they were found, and the share of progress."""
    import numpy as np

    from simplexmesh._base.progress import part_of
    from simplexmesh.data.conversion import as_data
    from simplexmesh.motion.reconstruct.conversion import joined_scans
    from simplexmesh.recognition.scans.reconstruct import SHARE, check_choices, needs_poses, posed_scans

    words = {Path("auto"): "auto", Path("none"): [np.eye(4)] * len(inputs)}
    chosen: Any = None if poses is None else words.get(poses, poses)
    if needs_poses(inputs, chosen):
        check_choices(options)
        scans, found = posed_scans(inputs, chosen, part_of(shown, 0.0, SHARE))
        return joined_scans(scans, found and found.poses[list(found.groups[0])]), found, SHARE
    return as_data(inputs[0]) if len(inputs) == 1 and poses is None else joined_scans(inputs, chosen), None, 0.0


def _poses(found: Any) -> dict[str, Any]:
    """Return the poses that were found, of the scans in the model by name, and the names of the others."""
    if found is None:
        return {}
    used = {found.names[k]: found.poses[k] for k in found.groups[0]}
    return {"poses": used, "left_out": [name for name in found.names if name not in used]}


def _reported(result: Any, output: Path, seconds: float, *, interrupted: bool) -> dict[str, Any]:
    """Return the report of a reconstruction, and print a note on each problem."""
    if interrupted:
        report.note(f"interrupted; the model reached so far is in {output}")
    elif not result.converged:
        report.note(f"the model did not converge in {len(result.history)} iterations; more --iterations may help")
    facts = described(result) | {"seconds": round(seconds, 3), "output": str(output)}
    for problem in facts["problems"]:
        report.note(f"the model has a defect: {problem}")
    return facts


def described(result: Any) -> dict[str, Any]:
    """Return the report of a reconstruction: sizes, distances, topology, and the defects of the mesh."""
    from simplexmesh.motion.model.state import mean_edge

    mesh = result.mesh
    return {
        **report.mesh_numbers(mesh),
        "mean_edge": mean_edge(mesh),
        "distance": asdict(result.distance),
        "iterations": len(result.history),
        "converged": result.converged,
        "interrupted": result.interrupted,
        "tangled": result.tangled,
        "creases": {"count": len(result.creases), "length": sum(line.length for line in result.creases)},
        "topology": _changes(result.topology),
        "problems": list(mesh.check(self_intersections=True).problems),
    }


def _changes(topology: Any) -> dict[str, Any]:
    """Return the changes of topology, proposal by proposal."""
    return {
        kind: [
            {"accepted": proposal.accepted, "reason": proposal.reason, "what": repr(proposal)} for proposal in proposals
        ]
        for kind, proposals in (("holes", topology.holes), ("handles", topology.handles))
    } | {name: getattr(topology, name) for name in ("refined", "exchanged", "swapped", "exceptions")}


def _summary(changes: dict[str, Any]) -> dict[str, str]:
    """Return the same as text; empty where nothing was considered."""
    said = []
    for kind in ("holes", "handles"):
        done = sum(proposal["accepted"] for proposal in changes[kind])
        reasons = [proposal["reason"] for proposal in changes[kind] if not proposal["accepted"]]
        if changes[kind]:
            said.append(
                f"{done} {kind[:-1] if done == 1 else kind} made"
                + "".join(f", one rejected: {reason}" for reason in reasons)
            )
    if changes["refined"]:
        said.append(f"{changes['refined']:,} vertices by refinement")
    if changes["exchanged"]:
        said.append(f"{changes['exchanged']:,} faces divided for as many merged")
    if changes["exceptions"]:
        said.append(f"{len(changes['exceptions']):,} faces of fewer than 5 or more than 7 vertices")
    return {"topology": "\n".join(said)} if said else {}


def _rows(facts: dict[str, Any]) -> dict[str, str]:
    """Return the rows of the table."""
    rest = "interrupted" if facts["interrupted"] else "converged" if facts["converged"] else "not converged"
    enclosed = facts["distance"]["enclosed"]
    creases = facts["creases"]
    within = {"enclosed": f"{enclosed['count']:,} data points far inside the model, up to {enclosed['max']:.4g}"}
    return {
        **report.mesh_rows(facts),
        "mesh to data": _spread(facts["distance"]["mesh_to_data"]),
        "data to mesh": _spread(facts["distance"]["data_to_mesh"]),
        **(within if enclosed["count"] else {}),
        **_summary(facts["topology"]),
        **({"sharp edges": f"{creases['count']}, length {creases['length']:.4g}"} if creases["count"] else {}),
        "fit": f"{facts['iterations']} iterations, {rest}",
        "problems": "\n".join(facts["problems"]) or "none",
        "time": f"{facts['seconds']:.1f} s",
    }


def _spread(spread: dict[str, float]) -> str:
    return f"mean {spread['mean']:.4g}, rms {spread['rms']:.4g}, 95 % {spread['p95']:.4g}, max {spread['max']:.4g}"
