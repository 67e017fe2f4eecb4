"""Range and default first step of each kind of parameter in a fit.

Positions, directions and poses are not here: `rigid_variables` and `variables` set their steps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..scene import parameters
from ..scene.scene import Scene

# First steps: of colours and weights, absolute; of angles, radians; of UV maps and lens shifts, widths of the picture;
# of powers, sizes and radiances, a fraction of their value. Larger steps converge in fewer iterations, but overshoot.
WEIGHT_STEP = 0.03
ANGLE_STEP = 0.03
SHIFT_STEP = 0.01
RELATIVE_STEP = 0.03
# Sizes stay above this fraction of their initial value. A light of size 0 is another kind of light: it has no
# derivative by its size, so the fit could not enlarge it again.
LEAST_SIZE = 1e-3

_ANY, _UNIT, _POSITIVE = (-np.inf, np.inf), (0.0, 1.0), (0.0, np.inf)


@dataclass(frozen=True)
class Kind:
    """Range and first step of a kind of parameter.

    Attributes
    ----------
    range
        Smallest and largest value.
    step
        Length of the first step; a relative one is a fraction of the value.
    relative
        Whether the step is relative.
    size
        Whether the value must stay above zero (`LEAST_SIZE`).
    """

    range: tuple[float, float]
    step: float
    relative: bool = False
    size: bool = False


_COLOR = Kind(_UNIT, WEIGHT_STEP)
_POWER = Kind(_POSITIVE, RELATIVE_STEP, relative=True)
_SIZE = Kind(_POSITIVE, RELATIVE_STEP, relative=True, size=True)
_OPENING = Kind((0.0, np.pi), RELATIVE_STEP, relative=True, size=True)

# Kinds by field name: a field means the same on every object.
_FIELDS: dict[str, Kind] = {
    **dict.fromkeys(
        ("base_color", "specular_tint", "coat_tint", "sheen_tint", "metallic", "roughness", "diffuse_roughness",
         "transmission", "coat_weight", "coat_roughness", "sheen_weight", "sheen_roughness", "alpha",
         "subsurface_weight", "blend", "normal"), _COLOR),
    **dict.fromkeys(("color", "specular_ior_level", "normal_strength", "weights", "absorption"),
                    Kind(_POSITIVE, WEIGHT_STEP)),
    **dict.fromkeys(("emission", "power", "strength", "smooth"), _POWER),
    **dict.fromkeys(("radius", "size", "ortho_width", "pixel_aspect", "focus_distance", "aperture_radius",
                     "aperture_ratio", "stretch", "fisheye_lens"), _SIZE),
    **dict.fromkeys(("angle", "spread"), _OPENING),
    "fov_x": Kind((0.0, np.pi - 0.01), RELATIVE_STEP, relative=True, size=True),
    **dict.fromkeys(("ior", "thin_film_ior"), Kind((0.01, np.inf), WEIGHT_STEP)),
    "thin_film_thickness": Kind(_POSITIVE, RELATIVE_STEP, relative=True),
    "coat_ior": Kind((1.0, np.inf), WEIGHT_STEP),
    "anisotropy": Kind((-1.0, 1.0), WEIGHT_STEP),
    "anisotropy_rotation": Kind(_ANY, ANGLE_STEP / (2.0 * np.pi)),  # turns
    "fisheye_fov": Kind((0.01, 2.0 * np.pi), RELATIVE_STEP, relative=True, size=True),
    **dict.fromkeys(("aperture_rotation", "longitude", "latitude", "fisheye_polynomial"), Kind(_ANY, ANGLE_STEP)),
    "shift": Kind(_ANY, SHIFT_STEP),
}  # fmt: skip


# Of a medium, whose coefficients stay positive where they are: there are no derivatives where it vanishes.
_MEDIUM_FIELDS: dict[str, Kind] = {
    "scattering": _SIZE,
    "absorption": _SIZE,
    "anisotropy": Kind((-0.999, 0.999), WEIGHT_STEP),
}


def kind_of(scene: Scene, path: str) -> Kind:
    """Return the kind of a parameter that is not a position, a direction or a pose."""
    collection, name, field = parameters.split(path)
    value = np.asarray(parameters.get(scene, path))
    within = bool(value.size) and value.min() >= 0.0 and value.max() <= 1.0
    if collection == "images":
        # The image of the environment is radiance. Any other image within [0, 1] is a colour, a weight or a normal map.
        return _POWER if scene.world.image == name else _COLOR if within else Kind(_ANY, RELATIVE_STEP, relative=True)
    if parameters.layer_of(field) is not None:
        uv = collection == "meshes" and value.shape[-1] == 2
        return Kind(_ANY, SHIFT_STEP) if uv else _COLOR if within else Kind(_ANY, RELATIVE_STEP, relative=True)
    if field.startswith(parameters.TEXTURES):
        return Kind(_ANY, RELATIVE_STEP, relative=True)
    if field.startswith(parameters.MEDIUM):
        return _MEDIUM_FIELDS[field[len(parameters.MEDIUM) :]]
    return _FIELDS[field]


def limits(scene: Scene, path: str) -> tuple[float, float]:
    """Return the smallest and largest value that entries of a parameter may have during a fit."""
    kind = kind_of(scene, path)
    low, high = kind.range
    value = np.asarray(parameters.get(scene, path), np.float64)
    if kind is _POWER and value.size == 1 and value < 0.0:  # a light that takes light away
        return -high, -low
    return (max(low, LEAST_SIZE * float(value.min())) if kind.size else low), high


def first_step(scene: Scene, path: str) -> float:
    """Return the default length of the first step of a parameter."""
    kind = kind_of(scene, path)
    if not kind.relative:
        return kind.step
    value = np.abs(np.asarray(parameters.get(scene, path), np.float64))
    # Large arrays use the mean, so that one bright texel does not set the step. A parameter that starts at 0 has no
    # scale: its step is in its own unit.
    scale = float(value.mean() if parameters.split(path)[0] in ("images", "meshes", "fields") else value.max())
    return kind.step * (scale or 1.0)
