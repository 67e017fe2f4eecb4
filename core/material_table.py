"""Materials as a table of numbers: where each field of a shader stands in its row (native/scene/material_params.h)."""

from __future__ import annotations

# Field to (first place, number of values).
COLUMNS = {
    "base_color": (0, 3),
    "emission": (3, 3),
    "metallic": (6, 1),
    "roughness": (7, 1),
    "diffuse_roughness": (8, 1),
    "specular_ior_level": (9, 1),
    "specular_tint": (10, 3),
    "ior": (13, 1),
    "anisotropy": (14, 1),
    "anisotropy_rotation": (15, 1),
    "transmission": (16, 1),
    "coat_weight": (17, 1),
    "coat_roughness": (18, 1),
    "coat_ior": (19, 1),
    "coat_tint": (20, 3),
    "sheen_weight": (23, 1),
    "sheen_roughness": (24, 1),
    "sheen_tint": (25, 3),
    "alpha": (28, 1),
    "subsurface_weight": (29, 1),
    "normal": (30, 3),
    "normal_strength": (33, 1),
    "weight": (34, 1),
}
WIDTH = 36
