"""The settings of Cycles' integrator and film."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from .table import BAKING, DATA, DISPLAY, EVALUATED, MOTION, NOISE, VOLUMES, Named, Table


def _simplifies(struct: Any, scene: Any) -> bool:
    return bool(scene.render.use_simplify)


def _culls(switch: str) -> Callable[[Any, Any], bool]:
    """Whether objects are culled: the same switch is on for an object."""
    return lambda _, scene: scene.render.use_simplify and any(getattr(ob.cycles, switch) for ob in scene.objects)


def _transparent(struct: Any, scene: Any) -> bool:
    return bool(scene.render.film_transparent)


_CULLED = "objects far from the camera's view are rendered, although culling is on"

INTEGRATOR = Table(
    read="max_bounces diffuse_bounces glossy_bounces transmission_bounces volume_bounces transparent_max_bounces "
         "pixel_filter_type filter_width film_exposure caustics_reflective caustics_refractive use_fast_gi "
         "fast_gi_method ao_bounces_render texture_limit_render blur_glossy",
    named={
        "film_transparent_glass": Named("the world is seen through glass, although 'Transparent Glass' is on",
                                        acts=_transparent),
        "use_camera_cull": Named(_CULLED, acts=_culls("use_camera_cull")),
        "use_distance_cull": Named(_CULLED, acts=_culls("use_distance_cull")),
        "texture_resolution_render": Named("images are read in full size; Cycles scales them by {value:g}", 1.0,
                                           _simplifies),
        # Their defaults make Cycles' pictures biased.
        "sample_clamp_direct": Named("direct light is not clamped; Cycles clamps it to {value}", 0.0, warns=False),
        "sample_clamp_indirect": Named("indirect light is not clamped; Cycles clamps it to {value}", 0.0,
                                       warns=False),
    },
    without={
        NOISE: "device shading_system feature_set *samples use_sample_subset sample_offset sample_subset_length "
               "time_limit sampling_pattern *scrambling_distance use_layer_samples light_sampling_threshold "
               "*adaptive_* direct_light_sampling_type use_light_tree min_light_bounces min_transparent_bounces "
               "*guiding* seed use_animated_seed debug_* use_auto_tile tile_size *denois* "
               "sample_all_lights_* sampling_pattern use_progressive_refine tile_order use_pixel_jitter",
        DISPLAY: "preview_* texture_limit texture_resolution ao_bounces",
        VOLUMES: "volume_step* volume_preview_step* volume_max_steps volume_biased",
        EVALUATED: "dicing_* max_subdivisions offscreen_dicing_scale",
        MOTION: "rolling_shutter_* motion_blur_position",
        "only 'Transparent Glass' uses it": "film_transparent_roughness",
        "culling is named by its switch": "camera_cull_margin distance_cull_margin",
        BAKING: "bake_type",
        DATA: "name",
    },
)  # fmt: skip
