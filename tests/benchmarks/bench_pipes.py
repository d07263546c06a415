"""Random lines of twelve elements followed from one pick: shares found, errors of radii and bends, CPU seconds.

Usage: python tests/benchmarks/bench_pipes.py [lines] [first seed]

Lines are seen over 200 degrees with noise of 2 % of the radius, 2 % of strays, two gaps of up to five radii, a wall and
a floor nearby, some 40,000 points; one more row has lines with a reducer. The pick is a point of a straight at random.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import simplexmesh as sm
from tests.cloud.scenes.line_scoring import apart, line_score
from tests.cloud.scenes.piping import Make, pipe_line

CASES = {"bends": Make(), "a reducer": Make(reducers=1)}
TURNS = ((60, 180), (30, 60), (0, 30))
"""Degrees by which bends turn, whose radii are told apart."""


def followed(line, seed):
    """The elements from a random pick, and CPU seconds."""
    pick = line.points[np.random.default_rng(seed).choice(line.picks)]
    began = time.process_time()
    try:
        found = sm.follow_pipe(line.points, pick)
    except ValueError as error:
        print(f"seed {seed}: {error}")
        return (), time.process_time() - began
    return found.elements, time.process_time() - began


def bend_errors(found, line):
    """The angle and the relative error of the radius of each true bend, infinite of those not found."""
    out = []
    for true in line.elements:
        if true.kind == "bend":
            near = min(found, key=lambda each, true=true: apart(each, true), default=None)
            miss = near is None or apart(near, true) > 1
            out.append((np.degrees(true.angle), np.inf if miss else abs(near.bend_radius / true.bend_radius - 1)))
    return out


def main() -> None:
    count, first = (int(x) for x in [*sys.argv[1:], *("20", "0")[len(sys.argv) - 1 :]])
    sm.follow_pipe((line := pipe_line(first)).points, line.points[line.picks[0]])  # compiles
    for case, make in CASES.items():
        scores, seconds, errors = [], [], []
        for seed in range(first, first + count):
            line = pipe_line(seed, make=make)
            found, took = followed(line, seed)
            scores.append(line_score(found, line))
            seconds.append(took)
            errors += bend_errors(found, line)
            if scores[-1].recall < 1 or scores[-1].precision < 1:
                print(f"seed {seed}: precision {scores[-1].precision:.2f}, missed {scores[-1].missed}")
        whole = sum(each.recall == 1 and each.precision == 1 and each.ordered for each in scores)
        radius = 100 * np.nanmedian([each.radius for each in scores])
        angles, off = np.array(errors).T
        print(f"{case}: all elements and no others in {whole} of {count}; radius off by {radius:.3f} % in the median")
        for low, high in TURNS:
            some = off[(angles >= low) & (angles < high)]
            if len(some):
                shares = f"{np.mean(some < 0.02):.0%} within 2 %, median {np.median(some):.2%}"
                print(f"  {len(some)} bends from {low} to {high} degrees: {shares}")
        print(f"  CPU seconds {np.mean(seconds):.3f}, most {max(seconds):.3f}", flush=True)


if __name__ == "__main__":
    main()
