"""Reports the settings of the data in use that change the picture and are not read."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy
import numpy as np

from ...problem import Report
from ..nodes.links import by_identifier
from .nodes import NODES
from .structs import STRUCTS
from .table import DEFAULT, Named, Table


def tables(rna: Any) -> Iterator[Table]:
    """Yield the tables of a type (its ``bl_rna``) and of the types that it extends."""
    while rna is not None:
        if rna.identifier in STRUCTS:
            yield STRUCTS[rna.identifier]
        rna = rna.base


def name_settings(struct: Any, where: str, scene: Any, report: Report) -> None:
    """Report each setting of a structure, and of the structures in it, that is named and acts.

    Parameters
    ----------
    struct
        Material, light, camera, object, world, view layer, scene or render settings; may be None.
    where
        What the sentences are about ("light 'Sun'").
    scene
        Blender's scene, whose settings decide whether others act.
    """
    if struct is None:
        return
    for table in tables(struct.bl_rna):
        for name, named in table.named.items():
            # Blender's versions have different settings.
            if hasattr(struct, name) and not _is_neutral(struct, name, named) and named.acts(struct, scene):
                say = report.warn if named.warns else report.tell
                say(where, named.sentence.format(value=_shown(getattr(struct, name))))
        for name in table.nested.split():
            name_settings(getattr(struct, name, None), where, scene, report)


def name_scene(scene: Any, view_layer: Any, camera: Any, world: Any, report: Report) -> None:
    """Report the settings of the scene, its view layer, camera and world that are named."""
    where = f"scene '{scene.name}'"
    for struct in (scene.render, getattr(scene, "cycles", None), getattr(bpy.data, "colorspace", None)):
        name_settings(struct, where, scene, report)
    name_settings(view_layer, f"view layer '{view_layer.name}'", scene, report)
    if camera is not None:
        name_settings(camera.data, f"camera '{camera.name}'", scene, report)
    if world is not None:
        name_settings(world, f"world '{world.name}'", scene, report)


def node_sentences(node: Any) -> Iterator[str]:
    """Yield a sentence for each setting and input of a shader node that is named and acts."""
    table = NODES.get(node.type)
    for name, named in table.named.items() if table is not None else ():
        if name in node.bl_rna.properties:
            changes, value = not _is_neutral(node, name, named), getattr(node, name)
        else:
            socket = by_identifier(node.inputs, name.replace("_", " "))
            if socket is None:
                continue
            changes, value = socket.is_linked or not _equal(socket.default_value, named.neutral), socket.name
        if changes and named.acts(node, None):
            yield named.sentence.format(value=_shown(value))


def _is_neutral(struct: Any, name: str, named: Named) -> bool:
    """Whether a setting has the value at which it changes nothing."""
    neutral = _default(struct.bl_rna.properties[name]) if named.neutral is DEFAULT else named.neutral
    return _equal(getattr(struct, name), neutral)


def _default(rna: Any) -> Any:
    if rna.type in ("POINTER", "COLLECTION"):
        return None
    return tuple(rna.default_array) if getattr(rna, "is_array", False) else rna.default


def _equal(value: Any, neutral: Any) -> bool:
    if value is None or neutral is None or isinstance(value, (bool, int, str)):
        return bool(value == neutral)
    if isinstance(value, float) and isinstance(neutral, (float, int)):
        return abs(value - neutral) <= 1e-9 + 1e-6 * abs(neutral)
    return bool(np.allclose(value, neutral, rtol=1e-6, atol=1e-9))  # values of Blender are in single precision


def _shown(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:g}"
    return str(getattr(value, "name", value))
