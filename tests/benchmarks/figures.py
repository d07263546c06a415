"""Figures that benchmarks print, stored with `--store` for the tests of the pages that quote them.

`results/NAME.json` has the protocol in a sentence, the day and the commit of the last run, the versions of the peers
measured in the same process, and of each figure its unit and its values, one a seed or repetition. A part that is run
again replaces its own figures only: of the others `git blame` tells the run. What could not be run here is in
`results/quoted.json`, each figure with its source and protocol. The peers that are no dependencies: pip install open3d
small_gicp kiss-matcher pymeshlab compas_cgal robust_laplacian trimesh rtree.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from datetime import date
from importlib import metadata
from pathlib import Path
from types import ModuleType
from typing import Any

RESULTS = Path(__file__).parent / "results"
STORING = "--store" in sys.argv
sys.argv[:] = [argument for argument in sys.argv if argument != "--store"]  # the rest is the benchmark's


def stored(name: str) -> dict[str, Any]:
    """Return what is stored of a benchmark."""
    path = RESULTS / f"{name}.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {"figures": {}}


def installed(*names: str) -> dict[str, ModuleType]:
    """Return the peers that can be imported, and say which are left out."""
    found = {}
    for name in names:
        try:
            found[name] = __import__(name, fromlist=["_"])
        except ImportError as error:
            print(f"{name} is left out: {error}")
    return found


def commit() -> str:
    """Return the commit checked out, "-dirty" if something differs from it."""
    describe = ["git", "describe", "--always", "--dirty", "--exclude=*"]
    return subprocess.run(describe, cwd=RESULTS, check=True, capture_output=True, text=True).stdout.strip()


class Figures:
    """The figures of one run of a benchmark."""

    def __init__(self, name: str, protocol: str, peers: Sequence[str] = ()):
        self.name, self.protocol, self.peers, self.found = name, protocol, peers, {}

    def add(self, key: str, values: Sequence[float], unit: str) -> None:
        """Print a figure, its mean and its range, and keep it."""
        values = [float(f"{value:.5g}") for value in values]
        mean = sum(values) / len(values)
        spread = f" ({min(values):.5g} to {max(values):.5g}, {len(values)})" if len(values) > 1 else ""
        print(f"{key}: {mean:.5g}{spread} {unit}", flush=True)
        self.found[key] = {"unit": unit, "values": values}

    def keep(self) -> None:
        """Write the figures among those stored before, if `--store` was given."""
        if not STORING:
            return
        peers = {peer: metadata.version(peer) for peer in self.peers}
        known = stored(self.name)
        head = {
            "benchmark": f"bench_{self.name}.py",
            "protocol": " ".join(self.protocol.split()),
            "machine": "two cores",
            "last run": {"day": str(date.today()), "commit": commit()},
            "peers": dict(sorted((known.get("peers", {}) | peers).items())),
        }
        figures = sorted((known["figures"] | self.found).items())
        lines = (f"  {json.dumps(key, ensure_ascii=False)}: {json.dumps(figure)}" for key, figure in figures)
        opened = json.dumps(head, indent=1, ensure_ascii=False).removesuffix("\n}")
        text = f'{opened},\n "figures": {{\n' + ",\n".join(lines) + "\n }\n}\n"
        RESULTS.mkdir(exist_ok=True)
        (RESULTS / f"{self.name}.json").write_text(text, encoding="utf-8")
