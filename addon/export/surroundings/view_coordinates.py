"""Coordinates of the camera in the nodes of a world: their bake has a camera of its own."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.geometry.camera_view import pixel_angles
from edgegrad.scene.camera import PANORAMAS

from ..nodes.links import reached

# Outputs of Texture Coordinate nodes that depend on the camera.
OF_CAMERA = ("Camera", "Window")
# Turns the axes of a camera to those of the world for which it renders a panorama with +X in the middle.
UPRIGHT = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def reads_camera(tree: Any) -> bool:
    """Whether nodes of a world depend on the camera."""
    return any(node.type == "CAMERA"
               or (node.type == "VECT_TRANSFORM" and "CAMERA" in (node.convert_from, node.convert_to))
               or (node.type == "TEX_COORD" and any(node.outputs[name].is_linked for name in OF_CAMERA))
               for node in reached(tree))  # fmt: skip


def rotation_of(view: edgegrad.Camera) -> NDArray[np.float64]:
    """(3, 3) rotation from directions in the world to those in a panorama that has the view's pose."""
    return UPRIGHT @ view.to_world[:3, :3].T


def replace_coordinates(tree: Any, view: edgegrad.Camera) -> list[str]:
    """Make the nodes of a world that a panorama with the view's pose renders those of the view.

    Returns
    -------
    A sentence for each kind of coordinates that keeps the values of the panorama.
    """
    unread: dict[str, None] = {}
    for node in list(reached(tree)):
        if node.type == "CAMERA" or (node.type == "VECT_TRANSFORM" and node.convert_from == "CAMERA"):
            unread[f"node '{node.name}' ({node.bl_label})"] = None
        elif node.type == "VECT_TRANSFORM" and node.convert_to == "CAMERA":
            _of_view(node, node.outputs[0])
        elif node.type == "TEX_COORD" and any(node.outputs[name].is_linked for name in OF_CAMERA):
            place = _of_view(node, node.outputs["Camera"])
            if view.kind == "PERSPECTIVE":
                _window(node, place, view)
            elif node.outputs["Window"].is_linked:
                unread[f"'Window' of node '{node.name}'"] = None
    return [f"{name} can't be read here: it has the values of a panorama" for name in unread]


def _of_view(node: Any, output: Any) -> Any:
    """Turn a vector from the axes that Cycles gives panoramas to those of other cameras; returns the new output."""
    tree, targets = node.id_data, [link.to_socket for link in output.links]
    parts, minus, whole = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("SeparateXYZ", "Math", "CombineXYZ"))
    minus.operation, minus.inputs[1].default_value = "MULTIPLY", -1.0
    for source, target in ((output, parts.inputs[0]), (parts.outputs[1], minus.inputs[0]),
                           (minus.outputs[0], whole.inputs[0]), (parts.outputs[2], whole.inputs[1]),
                           (parts.outputs[0], whole.inputs[2]),
                           *((whole.outputs[0], socket) for socket in targets)):  # fmt: skip
        tree.links.new(source, target)
    return whole.outputs[0]


def _window(node: Any, place: Any, view: edgegrad.Camera) -> None:
    """Compute the window coordinates of a perspective view from its camera coordinates."""
    tree, targets = node.id_data, [link.to_socket for link in node.outputs["Window"].links]
    high = view.height * view.pixel_aspect  # in widths of a pixel
    parts = tree.nodes.new("ShaderNodeSeparateXYZ")
    slope, window = (tree.nodes.new("ShaderNodeVectorMath") for _ in range(2))
    slope.operation, window.operation = "DIVIDE", "MULTIPLY_ADD"
    window.inputs[1].default_value = (view.focal / view.width, view.focal / high, 0.0)
    window.inputs[2].default_value = (0.5 - view.shift[0], 0.5 - view.shift[1] * view.width / high, 0.0)
    for source, target in ((place, parts.inputs[0]), (place, slope.inputs[0]), (parts.outputs[2], slope.inputs[1]),
                           (slope.outputs[0], window.inputs[0]),
                           *((window.outputs[0], socket) for socket in targets)):  # fmt: skip
        tree.links.new(source, target)


def pixels_per_texel(view: edgegrad.Camera, width: int) -> float:
    """Number of the view's pixels that a texel of a panorama of this width covers, in the middle of the picture."""
    if view.kind in PANORAMAS:
        return float(2.0 * np.pi / pixel_angles(view)[0] / width)
    per_radian = view.focal if view.kind == "PERSPECTIVE" else view.width / (2.0 * np.pi)
    return float(2.0 * np.pi * per_radian / width)
