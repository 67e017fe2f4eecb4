"""Properties that are saved in the .blend: the targets and the settings of the panel."""

# This file has no postponed annotations, since Blender reads properties from annotations.
from typing import Any

import bpy

from .animated.stored import stored_wanted
from .derivative import DIRECTIONS
from .parameters import Names
from .session import Picture, Request
from .view_transforms import VIEW_ITEMS

# From 4.5 on, Blender warns about // in paths without this option. Older versions do not have the option.
PATH_OPTIONS = {"PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5, 0) else set()

def _is_camera(_: Any, ob: Any) -> bool:
    return bool(ob.type == "CAMERA")


class TargetItem(bpy.types.PropertyGroup):
    """A camera and its target picture."""

    camera: bpy.props.PointerProperty(name="Camera", type=bpy.types.Object, poll=_is_camera)  # type: ignore[valid-type]
    image: bpy.props.StringProperty(name="Image", subtype="FILE_PATH", options=PATH_OPTIONS,  # type: ignore[valid-type]
                                    description="Target picture of this camera: EXR, PNG, JPEG or TIFF")  # fmt: skip
    mask: bpy.props.StringProperty(name="Mask", subtype="FILE_PATH", options=PATH_OPTIONS,  # type: ignore[valid-type]
                                   description="Picture whose black pixels are ignored; may be empty")  # fmt: skip
    view: bpy.props.EnumProperty(name="View", items=VIEW_ITEMS,  # type: ignore[valid-type]
                                 description="View transform that the picture was saved with")  # fmt: skip


class ParameterItem(bpy.types.PropertyGroup):
    """A property of Blender that a fit may change. It holds the datablock itself, which may be renamed."""

    owner: bpy.props.PointerProperty(name="Datablock", type=bpy.types.ID)  # type: ignore[valid-type]
    path: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Data Path", description="Path of the property from its datablock")
    index: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Index", default=-1, min=-1, description="Which number of an array; -1: all")
    enabled: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Fit", default=True, description="Whether the fit changes this property")
    use_limits: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Bounds", default=False, description="Keep the values between the bounds")
    low: bpy.props.FloatProperty(name="Lowest", default=0.0)  # type: ignore[valid-type]
    high: bpy.props.FloatProperty(name="Highest", default=1.0)  # type: ignore[valid-type]
    step: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Step", default=0.0, min=0.0,
        description="First step, in the unit of the property; 0: from its effect on the scene")
    sensitivity: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Sensitivity", default=-1.0,
        description="Effect of a step on the loss at the start of the last fit, relative to the most effective "
        "parameter; negative: not known yet")


class Settings(bpy.types.PropertyGroup):
    """Settings of the panel, stored as Scene.edgegrad."""

    targets: bpy.props.CollectionProperty(type=TargetItem)  # type: ignore[valid-type]
    active_target: bpy.props.IntProperty()  # type: ignore[valid-type]
    parameters: bpy.props.CollectionProperty(type=ParameterItem)  # type: ignore[valid-type]
    active_parameter: bpy.props.IntProperty()  # type: ignore[valid-type]
    vertices: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Vertices", default=True, description="Move the vertices of the selected meshes")
    base_color: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Base Color", default=False, description="Change the base colors of the selected meshes' materials")
    iterations: bpy.props.IntProperty(name="Iterations", default=200, min=1, soft_max=1000)  # type: ignore[valid-type]
    samples: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Samples", default=16, min=1, soft_max=256,
        description="Samples per pixel of each iteration. More samples reduce the noise and take longer")
    smoothness: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Smoothness", default=0.0, min=0.0, soft_max=1000.0,
        description="How strongly neighbouring vertices move together; 0: chosen by the number of vertices")
    write_to: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Write to", items=(("SHAPE_KEY", "Shape Key", "A new shape key; the original shape stays as its basis"),
                                ("MESH", "Mesh", "The mesh itself")))  # fmt: skip
    field_resolution: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Resolution", default=64, min=16, soft_max=128, max=512,
        description="Cells of the field along the longest side of the object. Memory grows with the third power")
    field_start: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Start", items=(("SHAPE", "Shape", "The shape of the object"),
                             ("BALL", "Ball", "A ball in the object's bounding box")))  # fmt: skip
    direction: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Direction", items=tuple((d, d.capitalize(), "Direction of the vertices in the gradient")
                                      for d in DIRECTIONS))  # fmt: skip



CLASSES: tuple[Any, ...] = (TargetItem, ParameterItem, Settings)


def chosen(context: Any) -> Names:
    """Return the parameters chosen in the panel, of the selected mesh objects or else of the active one."""
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
    """Return the fit that is set in the panel."""
    settings = context.scene.edgegrad
    pictures = [Picture(item.camera.name if item.camera else "", item.image, item.mask, item.view)
                for item in settings.targets]  # fmt: skip
    return Request(
        pictures=pictures,
        names=chosen(context),
        iterations=settings.iterations,
        samples=settings.samples,
        smoothness=settings.smoothness or None,
        in_place=settings.write_to == "MESH",
        animated=tuple(stored_wanted(context.scene)),
    )
