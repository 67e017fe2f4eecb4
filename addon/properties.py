"""Properties that are saved in the .blend: the targets and the settings of the panel."""

# This file has no postponed annotations, since Blender reads properties from annotations.
from typing import Any

import bpy

from . import quality
from .animated.stored import PROPERTY, stored_wanted
from .look.derivative import DIRECTIONS
from .panel import derived
from .problem import Problem
from .rows import KINDS, names_of, switched_on, title
from .session import Request
from .targets.film import FrameRange
from .targets.pictures import Picture
from .vertex_options import AXES, VertexOptions
from .view_transforms import VIEW_ITEMS

# From 4.5 on, Blender warns about // in paths without this option. Older versions do not have the option.
PATH_OPTIONS = {"PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5, 0) else set()

QUALITY_ITEMS = tuple((name, one.label, one.use) for name, one in quality.QUALITIES.items())
DIRECTION_ITEMS = (
    ("NORMAL", "All / Normal", "All numbers of the parameter together; vertices move outwards, along their normals"),
    *((d, d, f"Vertices move along {d}; of a property, its number {d} alone") for d in DIRECTIONS if d != "NORMAL"),
)
TERM_ITEMS = (
    ("TOTAL", "Total", "The whole derivative"),
    ("interior", "Shading", "Shading that changes smoothly"),
    ("primary", "Camera Edges", "Edges that the camera sees"),
    ("shadow", "Shadow Edges", "Edges between a lit point and a light"),
    ("indirect", "Indirect Edges", "Edges between surfaces that light each other"),
)


def _edited(_: Any, __: Any) -> None:
    derived.forget()


def _line(row: Any) -> str:
    _, owner, words = title(row)
    return f"{owner}: {words}"


def _about(row: Any) -> str:
    # Blender asks at each draw of a row.
    return (derived.lines.get(derived.pointer(row)) or derived.parameter(row)).about


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
    ("gradients", "Gradients", "Differences of neighboring pixels: edges and texture; ignores smooth lighting"),
)


SYMMETRY_ITEMS = (
    ("NONE", "None", "Both sides are independent"),
    *((axis, axis, f"The two sides along {axis} are mirror images") for axis in AXES),
)


class TargetItem(bpy.types.PropertyGroup):
    """A camera and its target picture."""

    camera: bpy.props.PointerProperty(update=_edited, name="Camera", type=bpy.types.Object, poll=_is_camera)  # type: ignore[valid-type]
    image: bpy.props.StringProperty(update=_edited, name="Image", subtype="FILE_PATH", options=PATH_OPTIONS,  # type: ignore[valid-type]
                                    description="Target of this camera: EXR, PNG, JPEG, TIFF, or a movie")  # fmt: skip
    mask: bpy.props.StringProperty(name="Mask", subtype="FILE_PATH", options=PATH_OPTIONS,  # type: ignore[valid-type]
                                   description="Picture whose black pixels are ignored; may be empty")  # fmt: skip
    view: bpy.props.EnumProperty(name="View", items=VIEW_ITEMS,  # type: ignore[valid-type]
                                 description="View transform that the picture was saved with")  # fmt: skip
    datablock: bpy.props.PointerProperty(update=_edited,  # type: ignore[valid-type]
        name="Datablock", type=bpy.types.Image,
        description="Image of this .blend as the target, which replaces the file: a sequence, a movie, a painting")
    use_frame: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Own Frame", default=False, description="Use the frame below, not the scene's current one")
    frame: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Frame", default=1, min=0, description="Frame of the movie or sequence")
    kind: bpy.props.EnumProperty(update=_edited,  # type: ignore[valid-type]
        name="Match", items=KIND_ITEMS, description="What the target determines")
    silhouette_object: bpy.props.PointerProperty(update=_edited,  # type: ignore[valid-type]
        name="Object", type=bpy.types.Object, description="Object whose silhouette the mask shows")
    silhouette_collection: bpy.props.PointerProperty(update=_edited,  # type: ignore[valid-type]
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
    """Values that a fit may change. The row holds the datablock itself, which may be renamed."""

    # Blender's lists filter and sort by names.
    name: bpy.props.StringProperty(name="Name", get=_line, options={"SKIP_SAVE"})  # type: ignore[valid-type]
    about: bpy.props.StringProperty(name="About", get=_about, options={"SKIP_SAVE"})  # type: ignore[valid-type]
    kind: bpy.props.EnumProperty(update=_edited,  # type: ignore[valid-type]
        name="Kind", items=((PROPERTY, "Property", "Any animatable property, by its data path"),
                            *((name, kind.label, "") for name, kind in KINDS.items())))  # fmt: skip
    owner: bpy.props.PointerProperty(update=_edited, name="Datablock", type=bpy.types.ID)  # type: ignore[valid-type]
    path: bpy.props.StringProperty(update=_edited,  # type: ignore[valid-type]
        name="Data Path", description="Path of the property from its datablock")
    index: bpy.props.IntProperty(update=_edited,  # type: ignore[valid-type]
        name="Index", default=-1, min=-1, description="Which number of an array; -1: all")
    keyed: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Keyed", default=False,
        description="Give the property a keyframe at each frame of the film, even if it has none yet")
    enabled: bpy.props.BoolProperty(update=_edited,  # type: ignore[valid-type]
        name="Fit", default=True, description="Whether the fit changes this property")
    use_limits: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Bounds", default=False, description="Keep the values between the bounds")
    low: bpy.props.FloatProperty(name="Lowest", default=0.0)  # type: ignore[valid-type]
    high: bpy.props.FloatProperty(name="Highest", default=1.0)  # type: ignore[valid-type]
    step: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Step", default=0.0, min=0.0,
        description="First step, in the unit of the property; 0: from its effect on the scene")
    vertex_group: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Vertex Group", description="Weights of this group scale the moves of the vertices; empty: all move fully")
    lock: bpy.props.BoolVectorProperty(  # type: ignore[valid-type]
        name="Lock", size=3, subtype="XYZ", description="Vertices keep their places along these axes of the object")
    symmetry: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Symmetry", items=SYMMETRY_ITEMS, description="Axis of the object along which the shape is mirrored")
    sensitivity: bpy.props.FloatProperty(update=_edited,  # type: ignore[valid-type]
        name="Sensitivity", default=-1.0,
        description="Effect of a step on the loss at the start of the last fit, relative to the most effective "
        "parameter; negative: not known yet")


class Settings(bpy.types.PropertyGroup):
    """Settings of the panel, stored as Scene.edgegrad."""

    targets: bpy.props.CollectionProperty(type=TargetItem)  # type: ignore[valid-type]
    active_target: bpy.props.IntProperty()  # type: ignore[valid-type]
    parameters: bpy.props.CollectionProperty(type=ParameterItem)  # type: ignore[valid-type]
    active_parameter: bpy.props.IntProperty()  # type: ignore[valid-type]
    loss: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Loss", items=LOSS_ITEMS, description="How pictures are compared with their targets")
    iterations: bpy.props.IntProperty(update=_edited, name="Iterations", default=200, min=1, soft_max=1000)  # type: ignore[valid-type]
    samples: bpy.props.IntProperty(update=_edited,  # type: ignore[valid-type]
        name="Samples", default=16, min=1, soft_max=256,
        description="Samples per pixel of each iteration. More samples reduce the noise and take longer")
    use_frames: bpy.props.BoolProperty(update=_edited,  # type: ignore[valid-type]
        name="Film", default=False,
        description="Fit the frames of movies and numbered files (film.####.png); keyed properties get a keyframe at "
        "each frame")
    first_frame: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="First Frame", default=1, min=0, description="First frame of the film that is fitted")
    last_frame: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Last Frame", default=48, min=0, description="Last frame of the film that is fitted")
    frame_smoothness: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Smooth Motion", default=1e-3, min=0.0, soft_max=1.0, precision=4,
        description="Weight of smooth changes of keyed values from frame to frame; 0: none")
    restarts: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Restarts", default=0, min=0, soft_max=8, max=100,
        description="Other starts, found by a search over coarse pictures, that are fitted for a while; the fit goes "
        "on from the best")  # fmt: skip
    uncertainty: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Standard Errors", default=True,
        description="Measure at the end how well the pictures determine each parameter, and go on by Newton steps if "
        "the fit has not arrived. Takes about a fifth longer, with these steps up to three times as long")
    smoothness: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Smoothness", default=0.0, min=0.0, soft_max=1000.0,
        description="How strongly neighboring vertices move together; 0: falls during the fit")
    write_to: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Write to", items=(("SHAPE_KEY", "Shape Key", "A new shape key; the original shape stays as its basis"),
                                ("MESH", "Mesh", "The mesh itself")))  # fmt: skip
    field_resolution: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Resolution", default=64, min=16, soft_max=128, max=512,
        description="Cells of the field along the longest side of the object. Memory grows with the third power")
    field_start: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Start", items=(("SHAPE", "Shape", "The shape of the object"),
                             ("BALL", "Ball", "A ball in the object's bounding box")))  # fmt: skip
    field_values: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Fit Too", options={"ENUM_FLAG"}, default=set(), description="Values of the field's material that are "
        "fitted as well, where they vary over the surface",
        items=(("base_color", "Color", "Base color"), ("roughness", "Roughness", "Roughness"),
               ("metallic", "Metallic", "Metallic")))  # fmt: skip
    quality: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Quality", items=QUALITY_ITEMS, get=quality.get, set=quality.put,
        description="Sets iterations, samples and pictures per iteration")
    views_per_iteration: bpy.props.IntProperty(update=_edited,  # type: ignore[valid-type]
        name="Pictures", default=0, min=0,
        description="Targets that each iteration renders, in turns; 0: all of them")
    vertex_step: bpy.props.FloatProperty(  # type: ignore[valid-type]
        name="Vertex Step", default=0.0, min=0.0, soft_max=0.1, precision=4,
        description="Largest displacement of a vertex in the first step, as a part of the object's size; 0: 0.02")
    seed: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Seed", default=0, min=0, description="Equal seeds give equal results")
    show_shapes: bpy.props.BoolProperty(  # type: ignore[valid-type]
        name="Show in Viewport", default=True,
        description="Draw the shapes that a running fit has reached as lines in the 3D views")
    look_samples: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Samples", default=64, min=1, soft_max=1024, description="Samples per pixel of Render, Gradient and Check")
    direction: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Direction", items=DIRECTION_ITEMS, description="What moves in the gradient")
    term: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Term", items=TERM_ITEMS, description="Part of the derivative that is shown")


CLASSES: tuple[Any, ...] = (TargetItem, ParameterItem, Settings)


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


def _vertex_options(row: Any) -> VertexOptions:
    return VertexOptions(row.vertex_group, "".join(axis for axis, locked in zip(AXES, row.lock, strict=True) if locked),
                         "" if row.symmetry == "NONE" else row.symmetry)  # fmt: skip


def _film(settings: Any) -> FrameRange | None:
    """Return the frames of the panel."""
    if not settings.use_frames:
        return None
    out = FrameRange(settings.first_frame, settings.last_frame, smoothness=settings.frame_smoothness)
    try:
        out.check()
    except ValueError as error:
        raise Problem(f"the film: {error}") from None
    return out


def request(context: Any) -> Request:
    """Return the fit that is set in the panel."""
    settings = context.scene.edgegrad
    pictures = [_picture(item) for item in settings.targets]
    return Request(
        pictures=pictures,
        names=names_of(switched_on(context.scene)),
        iterations=settings.iterations,
        samples=settings.samples,
        seed=settings.seed,
        smoothness=settings.smoothness or None,
        vertex_step=settings.vertex_step or None,
        views_per_iteration=min(settings.views_per_iteration, len(pictures)) or None,
        in_place=settings.write_to == "MESH",
        animated=tuple(stored_wanted(context.scene)),
        loss=settings.loss,
        vertex_options={row.owner.name: _vertex_options(row) for row in switched_on(context.scene, "VERTICES")},
        film=_film(settings),
        restarts=0 if settings.use_frames else settings.restarts,
        uncertainty=settings.uncertainty,
    )
