"""Automatic initialization of the motion: a closed mesh of the right topology within a few cells of the data."""

from __future__ import annotations

from simplexmesh.motion.initial.from_points import start_from_points
from simplexmesh.motion.initial.from_volume import start_from_volume
from simplexmesh.motion.initial.report import StartReport
from simplexmesh.motion.initial.start import Start

__all__ = ["Start", "StartReport", "start_from_points", "start_from_volume"]
