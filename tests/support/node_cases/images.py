"""Images and shading nodes."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from edgegrad import expression as e
from tests.support.node_cases.operands import QX, Cases, P

if TYPE_CHECKING:
    from tests.support.node_cases.blender_nodes import Nodes


def image_pixels() -> dict[str, Any]:
    """Small pictures, (height, width, channels) rows from the top; the colours of "clear" are straight."""
    rng = np.random.default_rng(5)
    opaque = rng.uniform(0.0, 1.0, (4, 5, 4)).astype(np.float32)
    opaque[..., 3] = 1.0
    clear = rng.uniform(0.0, 1.0, (3, 7, 4)).astype(np.float32)
    clear[1, 2, 3] = 0.0
    return {"opaque": opaque, "clear": clear}


def images() -> Cases:
    """Image and environment textures."""
    import bpy

    pictures = {}
    for name, pixels in image_pixels().items():
        height, width, _ = pixels.shape
        made = bpy.data.images.new(name, width, height, alpha=True, float_buffer=True, is_data=False)
        made.colorspace_settings.name = "Linear Rec.709"
        made.alpha_mode = "STRAIGHT"
        stored = pixels.copy()
        stored[..., :3] *= pixels[..., 3:]  # buffers of floats are premultiplied
        made.pixels.foreach_set(stored[::-1].ravel())
        made.update()
        pictures[name] = made

    def image(name: str, alpha: bool, **settings: Any) -> Any:
        def node(n: Nodes) -> Any:
            made = n.node("TexImage", {0: n.p}, image=pictures[name], **settings)
            return (made.outputs[0], made.outputs[1]) if alpha else made.outputs[0]

        return node

    words = {"LINEAR": "Linear", "CLOSEST": "Closest", "CUBIC": "Cubic"}
    out: Cases = {}
    for interpolation in e.INTERPOLATIONS:
        for extension in e.EXTENSIONS:
            out[f"image {interpolation} {extension}"] = (
                image("opaque", True, interpolation=words[interpolation], extension=extension),
                e.ImageTexture("opaque", P, interpolation, extension))
        for alpha, mode in ((True, "STRAIGHT"), (False, "PREMULTIPLIED")):
            out[f"image {interpolation} {mode}"] = (
                image("clear", alpha, interpolation=words[interpolation]),
                e.ImageTexture("clear", P, interpolation, alpha=mode))
    for projection in ("SPHERE", "TUBE"):
        out[f"image {projection}"] = (image("opaque", True, projection=projection),
                                      e.ImageTexture("opaque", P, projection=projection))
    for blend in (0.0, 0.4):
        out[f"image BOX {blend}"] = (
            image("opaque", True, projection="BOX", projection_blend=blend),
            e.ImageTexture("opaque", P, projection="BOX", blend=blend, normal=(0.0, 0.0, 1.0)))
    for projection in ("EQUIRECTANGULAR", "MIRROR_BALL"):
        out[f"environment {projection}"] = (
            partial(lambda projection, n: n.node("TexEnvironment", {0: n.p}, image=pictures["opaque"],
                                                 projection=projection).outputs[0], projection),
            e.ImageTexture("opaque", P, projection=projection))
    return out


def shading() -> Cases:
    """Nodes of the angle to the viewer, who looks along -Z; the normal is P made a unit vector."""
    unit = e.VectorMath("NORMALIZE", P)

    def normal(n: Nodes) -> Any:
        return n.node("VectorMath", {0: n.p}, operation="NORMALIZE").outputs[0]

    out: Cases = {
        "fresnel": (lambda n: n.node("Fresnel", {0: n.component(n.q, 0), 1: normal(n)}).outputs[0],
                    e.Fresnel(QX, unit)),
        "normal": (lambda n: n.node("NewGeometry").outputs["Normal"], e.Coordinates("NORMAL")),
        "true normal": (lambda n: n.node("NewGeometry").outputs["True Normal"], e.Coordinates("TRUE_NORMAL")),
        "incoming": (lambda n: n.node("NewGeometry").outputs["Incoming"], e.Coordinates("INCOMING")),
        "reflection": (lambda n: n.node("TexCoord").outputs["Reflection"], e.Coordinates("REFLECTION")),
        "backfacing": (lambda n: n.node("NewGeometry").outputs["Backfacing"], e.Backfacing()),
        "camera ray": (lambda n: n.node("LightPath").outputs["Is Camera Ray"], e.LightPath("CAMERA")),
        "shadow ray": (lambda n: n.node("LightPath").outputs["Is Shadow Ray"], e.LightPath("SHADOW")),
    }
    for k, output in enumerate(("FRESNEL", "FACING")):
        out[f"layer weight {output}"] = (
            partial(lambda k, n: n.node("LayerWeight", {0: n.component(n.q, 0), 1: normal(n)}).outputs[k], k),
            e.LayerWeight(output, QX, unit))
    return out
