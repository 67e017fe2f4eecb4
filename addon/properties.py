"""What a .blend remembers: the targets and the settings of the panel."""

# No postponed annotations in this file: Blender reads properties from them.
from typing import Any

import bpy

from .derivative import DIRECTIONS
from .parameters import Names
from .session import Picture, Request

# From 4.5 on Blender warns about // in paths that don't have this option, which older versions don't know.
PATH_OPTIONS = {"PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5, 0) else set()

def _is_camera(_: Any, ob: Any) -> bool:
    return bool(ob.type == "CAMERA")


class TargetItem(bpy.types.PropertyGroup):
    """A picture of what a camera should see."""

    camera: bpy.props.PointerProperty(name="Camera", type=bpy.types.Object, poll=_is_camera)  # type: ignore[valid-type]
    image: bpy.props.StringProperty(name="Image", subtype="FILE_PATH", options=PATH_OPTIONS,  # type: ignore[valid-type]
                                    description="Picture that this camera should see: EXR, PNG or JPEG")  # fmt: skip
    mask: bpy.props.StringProperty(name="Mask", subtype="FILE_PATH", options=PATH_OPTIONS,  # type: ignore[valid-type]
                                   description="Picture whose black pixels are ignored; may be empty")  # fmt: skip


class Settings(bpy.types.PropertyGroup):
    """Scene.edgegrad."""

    targets: bpy.props.CollectionProperty(type=TargetItem)  # type: ignore[valid-type]
    active_target: bpy.props.IntProperty()  # type: ignore[valid-type]
    vertices: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Vertices", default=True, description="Move the vertices of the selected meshes")
    base_color: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Base Color", default=False, description="Change the base colors of the selected meshes' materials")
    iterations: bpy.props.IntProperty(name="Iterations", default=200, min=1, soft_max=1000)  # type: ignore[valid-type]
    samples: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Samples", default=16, min=1, soft_max=256,
        description="Quality of each iteration: samples per pixel. More make it surer, and slower")
    smoothness: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Smoothness", default=0.0, min=0.0, soft_max=1000.0,
        description="How far neighbouring vertices move along with each other; 0: chosen by the number of vertices")
    write_to: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Write to", items=(("SHAPE_KEY", "Shape Key", "A new shape key; the old shape stays as its basis"),
                                ("MESH", "Mesh", "The mesh itself")))  # fmt: skip
    direction: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Direction", items=tuple((d, d.capitalize(), "Where vertices move in the gradient") for d in DIRECTIONS))


CLASSES: tuple[Any, ...] = (TargetItem, Settings)


def chosen(context: Any) -> Names:
    """The parameters that the toggles choose, of the selected mesh objects (else of the active one)."""
    settings = context.scene.edgegrad
    objects = [ob for ob in context.view_layer.objects if ob.select_get() and ob.type == "MESH"]
    active = context.view_layer.objects.active
    if not objects and active is not None and active.type == "MESH":
        objects = [active]
    slots = [slot.material.name_full for ob in objects for slot in ob.material_slots if slot.material is not None]
    return Names(
        vertices=tuple(ob.name for ob in objects) if settings.vertices else (),
        base_color=tuple(dict.fromkeys(slots)) if settings.base_color else (),
    )


def request(context: Any) -> Request:
    """The fit that the panel describes."""
    settings = context.scene.edgegrad
    pictures = [Picture(item.camera.name if item.camera else "", item.image, item.mask) for item in settings.targets]
    return Request(
        pictures=pictures,
        names=chosen(context),
        iterations=settings.iterations,
        samples=settings.samples,
        smoothness=settings.smoothness or None,
        in_place=settings.write_to == "MESH",
    )
