"""The differentiable tables of a scene by their names in derivatives."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from edgegrad.derivatives.table_derivatives import shapes
from edgegrad.tables import materials as material_table
from edgegrad.tables.lights import ELLIPSE, RECTANGLE
from edgegrad.tables.tables import Tables

F64 = NDArray[np.float64]
# Fields that are floats and have no derivative.
WITHOUT = ("clip_start", "clip_end", "filter_width", "terminator_offset", "terminator_shading")


def values(flat: Tables) -> dict[str, F64]:
    """The tables by their names in derivatives."""
    out: dict[str, Any] = {
        "vertices": flat.vertices,
        "normals": flat.custom_normals,
        "instance_to_world": flat.instance_to_world,
        "closure_params": flat.materials.params,
        "light_params": flat.lights.params,
        "environment": flat.environment,
        "environment_rotation": flat.environment_rotation,
        "environment_pixels": flat.environment_pixels,
        "camera": flat.camera,
        "media": flat.media,
        "world_medium": flat.world_medium,
    }
    if flat.textures is not None:
        for name in ("pixels", "attributes", "lookups", "constants"):
            out[f"texture_{name}"] = getattr(flat.textures, name)
    out = {name: np.reshape(out[name], shape).astype(np.float64) for name, shape in shapes(flat).items()}
    # Area lights are rows of `light_params`; their hidden meshes and leaves aren't differentiated.
    area_lights = int(np.isin(flat.lights.kind, (RECTANGLE, ELLIPSE)).sum())
    out["vertices"][flat.mesh_first_vertex[len(flat.mesh_names)] :] = 0.0
    out["closure_params"][len(out["closure_params"]) - area_lights * material_table.WIDTH :] = 0.0
    return out
