"""The operator edgegrad.gradient."""

# This file has no postponed annotations, since Blender reads properties from annotations.
from typing import Any

import bpy
import numpy as np

from edgegrad import images

from ..derivative import derivative_picture
from ..properties import chosen
from . import _common


class Gradient(bpy.types.Operator):
    """Show the derivative of the picture by the chosen parameters: red is brighter, blue darker, white no change"""

    bl_idname = "edgegrad.gradient"
    bl_label = "Gradient"
    bl_options = {"REGISTER"}  # noqa: RUF012

    samples: bpy.props.IntProperty(name="Samples", default=64, min=1)  # type: ignore[valid-type]

    def execute(self, context: Any) -> set[str]:
        try:
            direction = context.scene.edgegrad.direction
            picture, export, notes = derivative_picture(context, chosen(context), direction, self.samples)
        except _common.EXPECTED as error:
            return _common.refuse(self, error)
        _common.tell(self, export.report, notes)
        codes = images.derivative_image(picture)
        _common.show("Edgegrad Gradient", images.srgb_to_linear(codes / np.float32(255.0)))
        self.report({"INFO"}, "the derivative is in the image 'Edgegrad Gradient'")
        return {"FINISHED"}
