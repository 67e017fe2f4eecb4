"""The render settings of a scene that do not belong to Cycles."""

from __future__ import annotations

from typing import Any

from .table import AFTER, BAKING, DATA, DISPLAY, EEVEE, EVALUATED, MOTION, NOISE, OTHER, VOLUMES, Named, Table


def _composited(struct: Any, scene: Any) -> bool:
    if hasattr(scene, "compositing_node_group"):  # from Blender 5.0 on
        return scene.compositing_node_group is not None
    return bool(scene.use_nodes and scene.node_tree is not None)


def _sequenced(struct: Any, scene: Any) -> bool:
    editor = scene.sequence_editor
    strips = getattr(editor, "strips_all", getattr(editor, "sequences_all", ()))  # renamed in Blender 4.4
    return len(strips) > 0


def _is_other_engine(render: Any, scene: Any) -> bool:
    return not render.engine.startswith("EDGEGRAD")


RENDER = Table(
    read="resolution_x resolution_y resolution_percentage pixel_aspect_x pixel_aspect_y film_transparent use_border "
         "border_min_x border_min_y border_max_x border_max_y use_crop_to_border filter_size",
    named={
        "engine": Named("is rendered like Cycles, although its engine is {value}", "CYCLES", _is_other_engine, False),
        "use_freestyle": Named("Freestyle's lines are left out"),
        "use_motion_blur": Named("motion blur is left out; everything is rendered at the current frame"),
        "use_multiview": Named("one picture is rendered by the camera itself; its stereo or multiple views are left "
                               "out"),
        "use_stamp": Named("Blender's text on the picture is left out"),
        "use_compositing": Named("the picture is the one that Cycles renders; the compositor's nodes are left out",
                                 False, _composited),
        "use_sequencer": Named("the picture is the one that Cycles renders; the sequencer's strips are left out",
                               False, _sequenced),
    },
    without={
        AFTER: "image_settings ppm_* ffmpeg fps fps_base dither_intensity use_placeholder use_overwrite "
               "use_file_extension file_extension is_movie_format filepath views_format metadata_input compositor_* "
               "use_render_cache use_stamp_* stamp_* save_output use_compositor_frames_cache",
        NOISE: "threads threads_mode use_persistent_data tile_* *texture_cache",
        MOTION: "motion_blur_*",
        EEVEE: "hair_type hair_subdiv use_high_quality_normals anisotropic_filter",
        EVALUATED: "frame_map_* use_simplify simplify_* use_simplify_normals",
        VOLUMES: "simplify_volumes",
        "views are named as a whole": "views stereo_views use_spherical_stereo",
        DISPLAY: "preview_* use_lock_interface sequencer_gl_preview use_sequencer_override_scene_strip",
        OTHER: "line_thickness_mode line_thickness",
        DATA: "use_single_layer has_multiple_engines",
        BAKING: "bake bake_* use_bake_*",
    },
)  # fmt: skip
