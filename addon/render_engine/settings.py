"""Settings of the render engine, stored as Scene.edgegrad_render."""

# This file has no postponed annotations, since Blender reads properties from annotations.
from typing import Any

import bpy

from ..export.approximated.sizes import WITH_FACES
from ..export.geometry.visibility import RAYS, terminator_offsets

ENGINE = "EDGEGRAD"
# Most samples of the engine (`edgegrad.render`).
MOST_SAMPLES = 1 << 24


class RenderEngineSettings(bpy.types.PropertyGroup):
    """Samples and seed of renders and of rendered views."""

    samples: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Render", default=64, min=1, max=MOST_SAMPLES, soft_max=4096,
        description="Samples per pixel of a render. Four times the samples halve the noise")
    preview_samples: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Viewport", default=256, min=1, max=MOST_SAMPLES, soft_max=4096,
        description="Samples per pixel after which a rendered view rests")
    seed: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Seed", default=0, min=0, description="Equal seeds give pictures of equal bits")


class EnginePanel:
    """A panel in the properties editor that is shown for this engine alone."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    COMPAT_ENGINES = {ENGINE}  # noqa: RUF012  Blender's convention

    @classmethod
    def poll(cls, context: Any) -> bool:
        return bool(context.engine in cls.COMPAT_ENGINES)


class SamplingPanel(EnginePanel, bpy.types.Panel):
    """Samples of the engine, in the properties of the render."""

    bl_idname = "EDGEGRAD_PT_sampling"
    bl_label = "Sampling"
    bl_context = "render"

    def draw(self, context: Any) -> None:
        layout, settings = self.layout, context.scene.edgegrad_render
        layout.use_property_split, layout.use_property_decorate = True, False
        column = layout.column(heading="Samples", align=True)
        column.prop(settings, "preview_samples")
        column.prop(settings, "samples")
        layout.prop(settings, "seed")


class FilmPanel(EnginePanel, bpy.types.Panel):
    """Transparency of the picture's background, in the properties of the render."""

    bl_idname = "EDGEGRAD_PT_film"
    bl_label = "Film"
    bl_context = "render"

    def draw(self, context: Any) -> None:
        layout, scene = self.layout, context.scene
        layout.use_property_split, layout.use_property_decorate = True, False
        cycles = getattr(scene, "cycles", None)
        if cycles is not None:
            layout.prop(cycles, "film_exposure")
            layout.prop(cycles, "pixel_filter_type", text="Filter")
            if cycles.pixel_filter_type != "BOX":
                layout.prop(cycles, "filter_width", text="Width")
        layout.prop(scene.render, "film_transparent", text="Transparent")


class PassesPanel(EnginePanel, bpy.types.Panel):
    """Passes of the engine, in the properties of the view layer."""

    bl_idname = "EDGEGRAD_PT_passes"
    bl_label = "Passes"
    bl_context = "view_layer"

    def draw(self, context: Any) -> None:
        layout, layer = self.layout, context.view_layer
        layout.use_property_split, layout.use_property_decorate = True, False
        column = layout.column(heading="Data")
        column.prop(layer, "use_pass_z")
        column.prop(layer, "use_pass_normal")
        column.prop(layer, "use_pass_object_index")
        column = layout.column(heading="Light")
        column.prop(layer, "use_pass_diffuse_color", text="Diffuse Color")


class RayVisibilityPanel(EnginePanel, bpy.types.Panel):
    """Kinds of rays that see an object, in the properties of the object."""

    bl_idname = "EDGEGRAD_PT_ray_visibility"
    bl_label = "Ray Visibility"
    bl_context = "object"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: Any) -> bool:
        ob = context.object
        return super().poll(context) and ob is not None and ob.type not in ("EMPTY", "CAMERA")

    def draw(self, context: Any) -> None:
        layout, ob = self.layout, context.object
        layout.use_property_split = True
        column = layout.column()
        for name in RAYS:
            column.prop(ob, f"visible_{name}")
        layout.prop(ob, "is_holdout")


class ShadowTerminatorPanel(EnginePanel, bpy.types.Panel):
    """Offsets of an object's shadow terminator, in the properties of the object."""

    bl_idname = "EDGEGRAD_PT_shadow_terminator"
    bl_label = "Shadow Terminator Offset"
    bl_context = "object"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: Any) -> bool:
        ob = context.object
        return super().poll(context) and ob is not None and ob.type in WITH_FACES and bool(terminator_offsets(ob))

    def draw(self, context: Any) -> None:
        layout = self.layout
        layout.use_property_split = True
        for (holder, name), text in zip(terminator_offsets(context.object), ("Geometry", "Shading"), strict=True):
            layout.prop(holder, name, text=text)


CLASSES: tuple[Any, ...] = (RenderEngineSettings, SamplingPanel, FilmPanel, PassesPanel, RayVisibilityPanel,
                            ShadowTerminatorPanel)  # fmt: skip
