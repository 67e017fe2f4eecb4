"""The world's colour."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

import edgegrad

from ..problem import Report
from . import nodes


def export_world(scene: Any, report: Report) -> edgegrad.World:
    """The constant environment of Blender's scene; black with a warning where it can't be read."""
    world = scene.world
    if scene.render.film_transparent:
        report.warn(f"scene '{scene.name}'", "its film is transparent, but the world is rendered as background")
    if world is None:
        return edgegrad.World()
    where = f"world '{world.name}'"
    tree = world.node_tree
    if tree is None or (bpy.app.version < (5, 0, 0) and not world.use_nodes):
        return edgegrad.World(np.array(world.color, np.float64))
    output = tree.get_output_node("CYCLES")
    fed_by = nodes.source(output.inputs["Surface"]) if output is not None else None
    if fed_by is None:
        return edgegrad.World()
    if fed_by.node.type != "BACKGROUND":
        report.warn(f"{where}, node '{fed_by.node.name}'", "only Background nodes can be read; the world is black")
        return edgegrad.World()
    at = f"{where}, node '{fed_by.node.name}'"
    color = nodes.color(fed_by.node.inputs["Color"], at, report)
    strength = nodes.number(fed_by.node.inputs["Strength"], at, report)
    if color.min() < 0.0 or strength < 0.0:
        report.warn(at, "negative light is treated as zero")
    return edgegrad.World(np.maximum(color, 0.0), max(strength, 0.0))
