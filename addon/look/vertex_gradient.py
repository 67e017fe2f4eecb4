"""The gradient of the loss by vertices, as colors on the mesh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad import images
from edgegrad.images.derivative_picture import SHOWN
from edgegrad.scene import parameters as values

from ..problem import Problem
from ..session import Session
from .derivative import outward_normals

F64 = NDArray[np.float64]

ATTRIBUTE = "Edgegrad Gradient"


@dataclass(frozen=True)
class VertexGradient:
    """How strongly the loss pushes the vertices of an object outwards.

    Attributes
    ----------
    object
        Name of the object.
    push
        (n,) decrease of the loss per motion along the normal, divided by the area around the vertex, so that it does
        not depend on the mesh.
    """

    object: str
    push: F64


def vertex_gradients(session: Session, progress: Any = None) -> list[VertexGradient]:
    """Return the gradients at the start of a fit, without access to Blender's data."""
    found: list[VertexGradient] = []

    def look(step: edgegrad.FitStep) -> str:
        for path, gradient in step.gradient.items():
            collection, name, fieldname = values.split(path) if path in session.wrt else ("", "", "")
            if collection == "meshes" and fieldname == "vertices":
                mesh = session.export.scene.meshes[name]
                found.append(VertexGradient(session.export.meshes[name].object, push_of(mesh, gradient)))
        return "restore"

    session.run(callback=look, progress=progress)
    if not found:
        raise Problem("no vertices without modifiers are among the parameters; add those of a mesh")
    return found


def push_of(mesh: edgegrad.Mesh, gradient: F64) -> F64:
    """(n,) decrease of the loss per outward motion and area, in world space."""
    linear = mesh.transform[:3, :3]
    in_world = gradient @ np.linalg.inv(linear)
    vertices = mesh.vertices @ linear.T
    push = -np.einsum("ij,ij->i", in_world, outward_normals(mesh))
    corners = vertices[mesh.faces]
    third = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 6.0
    area = np.bincount(mesh.faces.ravel(), np.repeat(third, 3), minlength=len(vertices))
    return np.divide(push, area, out=np.zeros_like(push), where=area > 0.0)


def paint(found: VertexGradient) -> float:
    """Write a gradient into a color attribute of the object's mesh: red is outwards, blue inwards; return the scale."""
    ob = bpy.data.objects.get(found.object)
    if ob is None or len(ob.data.vertices) != len(found.push):
        raise Problem(f"object '{found.object}': was changed meanwhile; nothing was written")
    sizes = np.abs(found.push[found.push != 0.0])
    scale = float(np.quantile(sizes, SHOWN)) if len(sizes) else 1.0
    codes = images.derivative_image(np.repeat(found.push[None, :, None], 3, axis=2), scale)[0]
    colors = np.ones((len(found.push), 4), np.float32)
    colors[:, :3] = images.srgb_to_linear(codes / np.float32(255.0))
    attributes = ob.data.color_attributes
    attribute = attributes.get(ATTRIBUTE)
    if attribute is not None and (attribute.domain != "POINT" or attribute.data_type != "FLOAT_COLOR"):
        attributes.remove(attribute)
        attribute = None
    if attribute is None:
        attribute = attributes.new(ATTRIBUTE, "FLOAT_COLOR", "POINT")
    attribute.data.foreach_set("color", colors.ravel())
    attributes.active_color = attributes[ATTRIBUTE]
    ob.data.update()
    return scale
