"""The settings of materials, lights, cameras, objects, worlds, view layers and renders, by Blender's structures."""

from __future__ import annotations

import bpy

from .integrator import INTEGRATOR
from .nodes import VOLUME_NODES
from .render import RENDER
from .table import AFTER, DATA, DISPLAY, EEVEE, EVALUATED, MOTION, NOISE, OTHER, PASSES, VOLUMES, Named, Table

DISPLACEMENT = "it is a method of displacement, which is read or named as a whole"
PANORAMAS = "it belongs to a type of panorama that is refused"
STEREO = "only stereo pictures use it, which are named at the scene"
FAST_GI = "only fast global illumination uses it, which is named at the scene"
_PANORAMA = ("panorama_type latitude_min latitude_max longitude_min longitude_max fisheye_fov fisheye_lens "
             + " ".join(f"fisheye_polynomial_k{k}" for k in range(5)))


def _has_caster(struct: object, scene: object) -> bool:
    """Whether an object casts caustics of lights that are made for them."""
    return any(ob.cycles.is_caustics_caster for ob in scene.objects)  # type: ignore[attr-defined]


def _has_volume(struct: object, scene: object) -> bool:
    """Whether a material or the world may have a volume."""
    trees = [held.node_tree for held in (*bpy.data.materials, *bpy.data.worlds) if held.node_tree is not None]
    return any(node.type in VOLUME_NODES for tree in (*trees, *bpy.data.node_groups) for node in tree.nodes)


_IN_VOLUMES = Named("it acts on light that volumes scatter, although its ray visibility 'Volume Scatter' is off", True,
                    acts=_has_volume)  # fmt: skip
_SHADOW_CAUSTICS = Named("its caustics are rendered by plain path tracing, without 'Shadow Caustics'",
                         acts=_has_caster)  # fmt: skip

STRUCTS: dict[str, Table] = {
    "ID": Table(without={DATA: "name name_full id_type session_uid is_evaluated original users use_fake_user "
                               "use_extra_user is_embedded_data is_linked_packed is_missing is_runtime_data "
                               "is_editable tag is_library_indirect library library_weak_reference asset_data "
                               "override_library preview deep_hash"}),
    "Material": Table(
        read="node_tree use_nodes pass_index diffuse_color displacement_method use_transparent_shadow",
        nested="cycles",
        without={
            EEVEE: "surface_render_method blend_method shadow_method alpha_threshold use_transparency_overlap "
                   "show_transparent_back use_backface_culling* use_raytrace_refraction use_screen_refraction "
                   "use_sss_translucency refraction_depth thickness_mode use_thickness_from_shadow "
                   "volume_intersection_method specular_color roughness specular_intensity metallic lightprobe*",
            DISPLACEMENT: "max_vertex_displacement",
            DISPLAY: "preview_render_type use_preview_world",
            OTHER: "line_color line_priority grease_pencil is_grease_pencil lineart",
            DATA: "animation_data texture_paint_* paint_*",
        },
    ),
    "CyclesMaterialSettings": Table(
        named={"use_bump_map_correction": Named("its shading at shadow terminators is corrected, although 'Bump Map "
                                                "Correction' is off")},
        without={NOISE: "emission_sampling volume_sampling", VOLUMES: "volume_i* volume_step* homogeneous_volume",
                 DATA: "name",
                 DISPLACEMENT: "displacement_method"},
    ),
    "Light": Table(
        read="type use_temperature color temperature temperature_color exposure normalize node_tree use_nodes "
             "use_shadow",
        nested="cycles",
        without={EEVEE: "*_factor use_custom_distance cutoff_distance use_contact_shadow contact_shadow_* "
                        "shadow_color shadow_buffer* use_shadow_jitter shadow_filter_radius "
                        "shadow_maximum_resolution shadow_jitter_overblur use_absolute_resolution "
                        "shadow_cascade_*", DATA: "animation_data"},
    ),
    "PointLight": Table(read="energy shadow_soft_size use_soft_falloff"),
    "SpotLight": Table(read="energy shadow_soft_size use_soft_falloff spot_blend spot_size",
                       without={DISPLAY: "show_cone", EEVEE: "use_square"}),
    "SunLight": Table(read="energy angle", without={EEVEE: "shadow_soft_size"}),
    "AreaLight": Table(read="energy shape size size_y spread", without={EEVEE: "shadow_soft_size"}),
    "CyclesLightSettings": Table(
        read="is_portal cast_shadow max_bounces",
        named={"is_caustics_light": _SHADOW_CAUSTICS},
        without={NOISE: "use_multiple_importance_sampling", DATA: "name"},
    ),
    "Camera": Table(
        read="type sensor_fit clip_start clip_end lens sensor_width sensor_height ortho_scale shift_x shift_y angle "
             f"angle_x angle_y {_PANORAMA}",
        nested="dof cycles",
        without={
            PANORAMAS: "central_cylindrical_* custom_* cycles_custom",
            STEREO: "stereo",
            DISPLAY: "passepartout_alpha display_size show_* lens_unit composition_guide_color background_images",
            DATA: "animation_data",
        },
    ),
    "CyclesCameraSettings": Table(  # until Blender 4.5
        read=_PANORAMA,
        without={PANORAMAS: "central_cylindrical_*", DATA: "name"},
    ),
    "CameraDOFSettings": Table(read="use_dof focus_object focus_subtarget focus_distance aperture_fstop "
                                    "aperture_blades aperture_rotation aperture_ratio"),
    "Object": Table(
        read="data type matrix_world material_slots pass_index color hide_render show_instancer_for_render is_holdout "
             "is_shadow_catcher is_instancer light_linking visible_camera visible_diffuse visible_glossy "
             "visible_transmission visible_shadow shadow_terminator_geometry_offset shadow_terminator_shading_offset",
        nested="cycles",
        named={"visible_volume_scatter": _IN_VOLUMES},
        without={
            EVALUATED: "mode parent* use_parent_final_indices location rotation_* scale dimensions delta_* lock_* "
                       "matrix_* track_axis up_axis modifiers constraints vertex_groups bound_box "
                       "add_rest_position_attribute field collision soft_body particle_systems rigid_body* "
                       "use_simulation_cache instance_* use_instance_* pose *shape_key* is_from_* "
                       "use_camera_lock_parent",
            DISPLAY: "empty_* image_user show_* use_empty_image_alpha display* hide_viewport hide_select "
                     "hide_surface_pick animation_visualization motion_path use_mesh_mirror_* active_* "
                     "selection_sets",
            EEVEE: "hide_probe_* shadow_terminator_normal_offset use_shadow_*",
            "only the Raycast node uses it, which is baked": "visible_raycast",
            PASSES: "lightgroup",
            OTHER: "shader_effects grease_pencil_modifiers use_grease_pencil_lights lineart "
                   "use_dynamic_topology_sculpting",
            DATA: "animation_data",
        },
    ),
    "CyclesObjectSettings": Table(
        read="shadow_terminator_geometry_offset shadow_terminator_offset",
        without={
            MOTION: "use_motion_blur use_deform_motion motion_steps",
            "culling is named at the scene": "use_camera_cull use_distance_cull",
            EVALUATED: "use_adaptive_subdivision dicing_rate",
            FAST_GI: "ao_distance",
            "shadow caustics are named at the lights that cast them": "is_caustics_*",
            DATA: "name",
        },
    ),
    "World": Table(
        read="color node_tree use_nodes",
        nested="cycles cycles_visibility",
        without={
            EEVEE: "use_eevee_finite_volume probe_resolution sun_* use_sun_*",
            FAST_GI: "light_settings",
            PASSES: "mist_settings lightgroup",
            DATA: "animation_data",
        },
    ),
    "CyclesWorldSettings": Table(
        read="max_bounces",
        named={"is_caustics_light": _SHADOW_CAUSTICS,
               "use_shadows": Named("its light casts shadows, although its 'Cast Shadow' is off", True)},
        without={NOISE: "sampling_method sample_map_resolution volume_sampling",
                 VOLUMES: "volume_i* volume_step* homogeneous_volume",
                 DATA: "name"},
    ),
    "CyclesVisibilitySettings": Table(
        read="camera diffuse glossy transmission",
        named={"scatter": _IN_VOLUMES},
        without={"the world blocks no light": "shadow", DATA: "name"},
    ),
    "ViewLayer": Table(
        read="use_sky use_solid material_override world_override layer_collection objects",
        nested="cycles",
        named={"use_volumes": Named("its volumes are rendered, although 'Volumes' is off", True, acts=_has_volume)},
        without={
            NOISE: "samples",
            PASSES: "use_pass_* pass_* aovs lightgroups",
            "hair is named where it is left out": "use_strand",
            FAST_GI: "use_ao",
            MOTION: "use_motion_blur",
            OTHER: "use_grease_pencil use_freestyle freestyle_settings",
            EEVEE: "eevee",
            DATA: "name use active_* has_export_collections depsgraph",
        },
    ),
    "CyclesRenderLayerSettings": Table(
        without={PASSES: "pass_* use_pass_* denoising_*", NOISE: "use_denoising", DATA: "name"},
    ),
    "RenderSettings": RENDER,
    "CyclesRenderSettings": INTEGRATOR,
    "BlendFileColorspace": Table(
        named={"working_space": Named("colors are taken as Linear Rec.709, not as {value}, the working space of the "
                                      "file", "Linear Rec.709"),
               "ocio_config_source": Named("colors are taken as Blender's own OpenColorIO configuration has them; the "
                                           "file's is another one", "BLENDER_OCIO")},
        without={AFTER: "is_missing_opencolorio_config is_failed_opencolorio_config",
                 DATA: "working_space_interop_id", "its source is named": "ocio_config_path"},
    ),
}  # fmt: skip
