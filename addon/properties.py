"""Properties that are saved in the .blend: the targets and the settings of the panel."""

# This file has no postponed annotations, since Blender reads properties from annotations.
from typing import Any

import bpy

from .animated.stored import stored_wanted
from .derivative import DIRECTIONS
from .parameters import Names
from .problem import Problem
from .session import Request
from .targets.pictures import Picture
from .view_transforms import VIEW_ITEMS

# From 4.5 on, Blender warns about // in paths without this option. Older versions do not have the option.
PATH_OPTIONS = {"PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5, 0) else set()

def _is_camera(_: Any, ob: Any) -> bool:
    return bool(ob.type == "CAMERA")


KIND_ITEMS = (
    ("PICTURE", "Picture", "The scene should look like the picture"),
    ("SILHOUETTE", "Silhouette", "The picture is a mask; objects should cover its white part, whatever their colors"),
)
LOSS_ITEMS = (
    ("pyramid", "Pyramid", "Squared differences at several resolutions, from coarse to fine"),
    ("l2", "Squares", "Mean squared difference"),
    ("l1", "Absolute", "Mean absolute difference"),
    ("huber", "Huber", "Squared differences; beyond 0.1, absolute ones, so that outliers pull less"),
    ("charbonnier", "Charbonnier", "Absolute differences, smooth below 0.01"),
    ("gradients", "Gradients", "Differences of neighbouring pixels: edges and texture; ignores smooth lighting"),
)


class TargetItem(bpy.types.PropertyGroup):
    """A camera and its target picture."""

    camera: bpy.props.PointerProperty(name="Camera", type=bpy.types.Object, poll=_is_camera)  # type: ignore[valid-type]
    image: bpy.props.StringProperty(name="Image", subtype="FILE_PATH", options=PATH_OPTIONS,  # type: ignore[valid-type]
                                    description="Target of this camera: EXR, PNG, JPEG, TIFF, or a movie")  # fmt: skip
    mask: bpy.props.StringProperty(name="Mask", subtype="FILE_PATH", options=PATH_OPTIONS,  # type: ignore[valid-type]
                                   description="Picture whose black pixels are ignored; may be empty")  # fmt: skip
    view: bpy.props.EnumProperty(name="View", items=VIEW_ITEMS,  # type: ignore[valid-type]
                                 description="View transform that the picture was saved with")  # fmt: skip
    datablock: bpy.props.PointerProperty(  # type: ignore[valid-type]
        name="Datablock", type=bpy.types.Image,
        description="Image of this .blend as the target, which replaces the file: a sequence, a movie, a painting")
    use_frame: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Own Frame", default=False, description="Use the frame below, not the scene's current one")
    frame: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Frame", default=1, min=0, description="Frame of the movie or sequence")
    kind: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Match", items=KIND_ITEMS, description="What the target determines")
    silhouette_object: bpy.props.PointerProperty(  # type: ignore[valid-type]
        name="Object", type=bpy.types.Object, description="Object whose silhouette the mask shows")
    silhouette_collection: bpy.props.PointerProperty(  # type: ignore[valid-type]
        name="Collection", type=bpy.types.Collection, description="Collection whose silhouette the mask shows")
    alpha: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Alpha", items=(("world", "World", "Transparent pixels show the scene's world"),
                             ("mask", "Mask", "Pixels that are not opaque are ignored")))  # fmt: skip
    exposure: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Exposure", items=(("FIXED", "Fixed", "The picture is brighter than the scene by known stops"),
                                ("exposure", "Unknown", "The fit finds how much brighter the picture is"),
                                ("white balance", "White Balance", "The fit finds it for red, green and blue")))
    stops: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Stops", default=0.0, min=-32.0, max=32.0,
        description="By how many stops the picture is brighter than the scene; 1 is a factor of 2")
    shared: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Shared", description="Targets with the same name here share their unknown exposure; may be empty")
    weight: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Weight", default=1.0, min=1e-6, soft_max=10.0, description="Weight of this target among all")


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
    loss: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Loss", items=LOSS_ITEMS, description="How pictures are compared with their targets")
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


def _picture(item: Any) -> Picture:
    """Return a target of the panel's list."""
    outline = item.kind == "SILHOUETTE"
    chosen = [held.name for held in (item.silhouette_object, item.silhouette_collection) if held is not None]
    if outline and not chosen:
        raise Problem("a target is a silhouette, but of no object; choose its Object or Collection")
    return Picture(
        item.camera.name if item.camera else "", item.image, item.mask, item.view, item.weight,
        2.0**item.stops if item.exposure == "FIXED" else item.exposure, item.shared, item.alpha,
        tuple(chosen) if outline else (), item.datablock.name if item.datablock else "",
        item.frame if item.use_frame else None,
    )  # fmt: skip


def request(context: Any) -> Request:
    """Return the fit that is set in the panel."""
    settings = context.scene.edgegrad
    return Request(
        pictures=[_picture(item) for item in settings.targets],
        names=chosen(context),
        iterations=settings.iterations,
        samples=settings.samples,
        smoothness=settings.smoothness or None,
        in_place=settings.write_to == "MESH",
        animated=tuple(stored_wanted(context.scene)),
        loss=settings.loss,
    )
