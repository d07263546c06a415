"""Reconstruction of a surface model from data in one call: the list of its steps."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from simplexmesh._base.progress import Progress, reporting
from simplexmesh.mesh.simplex_mesh import SimplexMesh
from simplexmesh.motion.reconstruct.changes import change_topology, redistribute, refine_and_fit
from simplexmesh.motion.reconstruct.conversion import as_input
from simplexmesh.motion.reconstruct.measure import measure
from simplexmesh.motion.reconstruct.options import Choice, Options
from simplexmesh.motion.reconstruct.restore import restore
from simplexmesh.motion.reconstruct.result import Reconstruction
from simplexmesh.motion.reconstruct.run import Run, finish, settle, started
from simplexmesh.motion.reconstruct.sharpen import along_edges, sharpen


def reconstruct(
    data: Any,
    *,
    level: float | None = None,
    label: int | None = None,
    vertices: int = 4000,
    init: str | Path | SimplexMesh = "auto",
    inside: str = "above",
    components: str = "auto",
    tunnels: float | None = None,
    poses: Any = None,
    iterations: int = 500,
    rigidity: int = 1,
    adaptation: float | None = None,
    placement: str | None = None,
    holes: Choice | None = None,
    handles: Choice | None = None,
    refine: str | None = None,
    creases: str = "auto",
    progress: bool | Progress = False,
) -> Reconstruction:
    """Fit a simplex mesh to a volume, a point cloud, scans or a triangulated surface.

    Parameters
    ----------
    data : Volume, PointCloud, TriangleMesh, array, pyvista or trimesh object, path, or sequence of scans
        An (n, 3) array is a point cloud, a 3-D array a volume of spacing 1. Equal positions are merged where no two
        triangles share a vertex, as in STL files.
    level : float, optional
        For a volume of intensities: the isovalue of the surface.
    label : int, optional
        For a label volume: the region. Optional when there is only one.
    vertices : int
        Number of vertices of the model; reached within 10 %. Primitives of fewer than 200 vertices come as close as
        their regular patterns allow.
    init : str, path or SimplexMesh
        ``"auto"`` finds a start of the right topology near the data; ``"sphere"``, ``"ellipsoid"``, ``"cylinder"``,
        ``"plane"`` and ``"torus"`` are placed around it; a mesh or a file of one is used as it is and keeps its
        topology (`vertices` is then ignored).
    inside : {"above", "below"}
        Whether the object of a volume is above or below `level`.
    components : {"auto", "largest", "all"}
        Which pieces to keep: by default all of a label, and the largest one of a level, of points and of triangles.
        Of triangles "all" keeps walls of cavities, which face them, too; else cavities are filled.
        "all" needs ``init="auto"``, other starts take the largest. Pieces of a label too small for a mesh are left out;
        `found` tells their share, from a thousandth on also a warning.
    tunnels : float, optional
        Width, in the data's unit, below which the automatic start seals tunnels through the body; 0 keeps them all.
        Default: what the mesh cannot resolve, and three voxels of a volume; points keep theirs.
    poses : path, mapping or sequence, optional
        For several scans: T_world_scan of each, by file name or in order; ``"auto"`` finds them, as `register_all`.
        Without any the scans keep their frames, unless these contradict each other: then poses are found, with a
        warning.
    iterations : int
        Maximum number of iterations of the fine stage.
    rigidity : int
        Radius, in edges, over which curvature is averaged in the fine stage: 1 follows the data closely, 6 is stiff.
    adaptation : float
        Strength, 0 to 0.25, with which vertices move to where the surface bends. Default: 0.05, or 0 for an even
        placement.
    placement : {"adaptive", "even"}
        Whether vertices are redistributed by curvature and distance to the data, as by `redistribute`: faces of high
        score are divided, those of low score merged. Default: "adaptive", but "even" when `adaptation` is 0, for a
        mesh given as start, for models with holes (`refine` places their vertices) and for bodies of a volume thinner
        than 4.5 edges on average.
    holes : {"auto", "none"}, callable or sequence of arrays of int
        Whether holes are opened where the data ends: "auto" (the default for primitives), "none", those that a
        function of a `HoleProposal` accepts, or the zones given, by the faces of the start. By default ``init="auto"``
        opens them in open surfaces only, those whose `found.openness` is above a quarter.
    handles : {"auto", "none"}, callable or sequence of pairs of int
        Whether handles are added to a sphere or ellipsoid (with `holes` "auto" or "none"; the default there), or those
        that a function of a `HandleProposal` accepts; or the pairs of faces of any start to join.
    refine : {"none", "auto", "coarse", "medium", "fine"}
        Refinement of faces that bend or are far from the data: "auto" (the default for primitives, and where holes
        are opened) begins with fewer vertices and uses all of `vertices`, the others stop at their threshold or at
        `vertices`.
    creases : {"auto", "none"}
        Whether the model gets the sharp edges of the data along its own edges, where the data tells them from what is
        round: "auto" looks for them in closed models, of labels for those that bend by more than steps of voxels do,
        45 degrees; "none" leaves all smooth. A model of closed triangles is made along theirs, without motion, if all
        parameters but `vertices` and `components` are as by default.
    progress : bool or callable
        True shows a bar; a function is called with the fraction done and a message.

    Returns
    -------
    Reconstruction
        The model; after an interrupt (Ctrl-C), its last complete state.

    Raises
    ------
    ValueError, TypeError, OSError, TopologyError
        For invalid data or arguments, before any long computation.

    Warns
    -----
    SimplexMeshWarning
        For data that was repaired, scans in different frames or that fit nowhere, cavities that are filled, and for a
        model that misses or encloses much of the data or fills a place, is one sheet where that has two layers, is far
        from data in a large part, strayed from it, has handles that noise may have made, lacks sharp edges of the data,
        remains tangled, is inside out, or whose motion ended early.

    References
    ----------
    H. Delingette, *General object reconstruction based on simplex meshes*, IJCV 32(2), 1999, 111-146,
    doi 10.1023/A:1008157432188; thesis, 1994, sections 5.1 to 5.5.

    Examples
    --------
    >>> import numpy as np, simplexmesh as sm
    >>> x, y, z = np.mgrid[-10:11, -10:11, -10:11].astype(float)
    >>> ball = sm.Volume(8.3 - np.sqrt(x * x + y * y + z * z), origin=(-10, -10, -10))
    >>> model = sm.reconstruct(ball, level=0.0, vertices=500)
    >>> model.mesh.genus, model.distance.mesh_to_data.rms < 0.05
    (0, True)
    """
    options = Options(
        init,
        vertices,
        components,
        tunnels,
        iterations,
        rigidity,
        adaptation,
        placement,
        holes,
        handles,
        refine,
        creases,
    )
    with reporting(progress, "reconstructing") as report:
        report(0.0, "reading")
        known = as_input(data, level=level, label=label, inside=inside, components=options.components, poses=poses)
        report(0.05, "finding a start")
        run = along_edges(known, options, report)
        steps: list[Callable[[Run], None]] = [measure]
        if run is None:
            run = started(known, options, report)
            steps = [settle, change_topology, refine_and_fit, redistribute, finish, restore, sharpen, measure]
        try:
            for step in steps:
                step(run)
        except KeyboardInterrupt:
            run.interrupted = True
    return run.result()
