"""The plan of the derivatives by the chosen parameters, in lines for the panel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import edgegrad

from ..animated.driver import Driver
from ..animated.parameter import Wanted
from ..differentiable import export_differentiable, let_normals_follow
from ..evaluation import active_camera
from ..export import Export
from ..parameters import Names


def planned(context: Any, names: Names, wanted: Sequence[Wanted]) -> tuple[Export, list[str]]:
    """Export the scene of the active camera; return it with the paths of the parameters."""
    scene = context.scene
    camera = active_camera(scene)
    names, controls = names.with_controls(scene, True, bool(wanted))
    export = export_differentiable(scene)
    paths = names.paths(export, may_be_empty=True)
    let_normals_follow(export, paths)
    if wanted or controls:
        driver = Driver(scene, [camera], wanted, controls)
        paths += driver.place({one.path: one.value for one in driver.variables}).paths[0]
    return export, list(dict.fromkeys(paths))


def lines(export: Export, paths: Sequence[str]) -> list[str]:
    """Return the plan's lines; those with a leading space are details."""
    limits = export.settings
    found = edgegrad.plan(export.scene, list(paths), max_depth=limits.max_depth, bounces=limits.bounces)
    return [line.replace("  - ", " ", 1) if line.startswith("  - ") else line for line in str(found).splitlines()]
