"""Materials as a table of numbers: one row for each shader of each material (native/scene/material_params.h)."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..expression import Bump, Combine, DisplacedBump, NormalMap, images_of, nodes_of
from ..scene.image import Image
from ..scene.material import KINDS, SHAPED, SMOOTH_NORMAL, Material, Mixture
from ..scene.scene import Scene

# Field to (first place in the row, number of values).
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
    "thin_film_thickness": (35, 1),
    "thin_film_ior": (36, 1),
    "absorption": (37, 3),
}
WIDTH = 40

# Fields on which `flags` depends, and the values at which a shader lacks what they are for.
NEUTRAL = {
    "metallic": 0.0,
    "specular_ior_level": 0.0,
    "transmission": 0.0,
    "coat_weight": 0.0,
    "sheen_weight": 0.0,
    "thin_film_thickness": 0.0,
    "diffuse_roughness": 0.0,
    "anisotropy": 0.0,
    "alpha": 1.0,
    "emission": 0.0,
    "absorption": 0.0,
}

# Bits of `MaterialTable.flags`: what may occur in a shader.
(DIFFUSE, GLOSSY, TRANSPARENCY, EMISSION, NORMAL_MAP, MULTISCATTER, TWO_SIDED, REFRACTION, LAMBERTIAN, ANISOTROPIC,
 BECKMANN, PHONG, NORMAL_IN_WORLD, ABSORPTION, THIN_FILM, NORMAL_BELOW) = (1 << k for k in range(16))  # fmt: skip


@dataclass
class MaterialTable:
    """L closures of M materials, those of area lights last."""

    first_closure: NDArray[np.int32]  # (M + 1,) each material's closures
    kind: NDArray[np.int32]  # (L,) place in material.KINDS
    flags: NDArray[np.int32]  # (L,) bits above
    params: NDArray[np.float32]  # (L, WIDTH)
    emits: NDArray[np.bool_]  # (L,) whether it may emit light
    closures_of: Mapping[str, tuple[int, ...]]  # by name: a shader's closures, also in mixtures; a mixture's parts


def material_table(
    scene: Scene, area_lights: list[NDArray[np.float64]], least_blue: dict[str, float]
) -> MaterialTable:
    """The table of a scene's materials, and of one-sided emitters of the given radiances.

    `least_blue` is `TextureTables.least_blue`, which this adds to.
    """
    closures: list[tuple[Material, float, bool]] = []
    first = [0]
    closures_of: dict[str, list[int]] = {name: [] for name in scene.materials}
    for own, material in scene.materials.items():
        if isinstance(material, Mixture):
            for k, name in enumerate(material.parts):
                part = scene.materials[name]
                assert isinstance(part, Material)  # Scene.validate has seen to it
                for key in (own, name):
                    closures_of[key].append(len(closures))
                closures.append((part, float(material.weights[k]), True))
            if is_padded(material):
                closures.append((Material(np.zeros(3)), 0.0, True))
        else:
            closures_of[own].append(len(closures))
            closures.append((material, 1.0, False))
        first.append(len(closures))
    for radiance in area_lights:
        closures.append((Material(np.zeros(3), radiance, False), 1.0, False))
        first.append(len(closures))
    params = np.zeros((len(closures), WIDTH), np.float32)
    for row, (closure, weight, _) in zip(params, closures, strict=True):
        for field, (place, count) in COLUMNS.items():
            row[place : place + count] = weight if field == "weight" else getattr(closure, field)
    kept = ~excluded_flags(scene)
    return MaterialTable(
        np.array(first, np.int32),
        np.array([KINDS.index(closure.kind) for closure, _, _ in closures], np.int32),
        np.array([flags(closure) & kept | _below(closure, scene.images, least_blue) for closure, _, _ in closures],
                 np.int32),
        params,
        np.array([closure.emits for closure, _, _ in closures], np.bool_),
        {name: tuple(rows) for name, rows in closures_of.items()},
    )


def is_padded(material: Material | Mixture) -> bool:
    """Whether the table adds a closure of weight 0: kernels read weights only for materials of several closures."""
    return isinstance(material, Mixture) and len(material.parts) == 1


def excluded_flags(scene: Scene) -> int:
    """Bits that no closure of the scene has: dimmed light does not follow the cosine (Mesh.terminator_shading)."""
    return LAMBERTIAN if any(mesh.terminator_shading > 0.0 for mesh in scene.meshes.values()) else 0


def flags(m: Material, asked: Collection[str] = ()) -> int:
    """Bits of what may occur in a shader: its kind's lobes whose weights are not zero everywhere, without NORMAL_BELOW.

    Fields that are `asked` for count as if they weren't neutral: a lobe's weight has a derivative where it is 0.
    """

    def may(field: str) -> bool:
        neutral = NEUTRAL[field]
        if field in m.textures or field in asked:
            return True
        value = getattr(m, field)
        return value != neutral if isinstance(value, float) else bool(np.any(np.asarray(value) != neutral))

    out = 0
    principled = m.kind == "PRINCIPLED"
    # A principled surface without specular level has no dielectric reflection; transmission keeps its own.
    film = m.kind in ("PRINCIPLED", "GLASS") and may("thin_film_thickness")
    dielectric = principled and (may("specular_ior_level") or may("transmission") or may("metallic") or film)
    coated = principled and (may("coat_weight") or may("sheen_weight"))
    if dielectric or coated or m.kind in ("GLOSSY", "GLASS", "REFRACTION", "SHEEN", "DISNEY", "VELVET"):
        out |= GLOSSY
    if principled or m.kind in ("DIFFUSE", "TRANSLUCENT", "DISNEY"):
        out |= DIFFUSE
    if m.kind in ("GLASS", "REFRACTION") or (principled and may("transmission")):
        out |= REFRACTION
    if m.kind == "TRANSPARENT" or (principled and may("alpha")):
        out |= TRANSPARENCY
    if may("emission"):
        out |= EMISSION
    if "normal" in m.textures or SMOOTH_NORMAL in m.textures:
        out |= NORMAL_MAP
        if "normal" in m.textures and m.normal_space == "WORLD":
            out |= NORMAL_IN_WORLD
    # The compensation's tables are those of GGX.
    if m.multiscatter and m.distribution == "GGX":
        out |= MULTISCATTER
    if m.kind in SHAPED:
        out |= {"GGX": 0, "BECKMANN": BECKMANN, "ASHIKHMIN_SHIRLEY": PHONG}[m.distribution]
    if m.emission_two_sided:
        out |= TWO_SIDED
    if may("anisotropy"):
        out |= ANISOTROPIC
    if film:
        out |= THIN_FILM
    if may("absorption"):
        out |= ABSORPTION
    if m.kind in ("PRINCIPLED", "DIFFUSE") and not out & (GLOSSY | REFRACTION) and not may("diffuse_roughness"):
        out |= LAMBERTIAN
    return out


def _below(m: Material, images: Mapping[str, Image], least_blue: dict[str, float]) -> int:
    """NORMAL_BELOW if shading normals may point below the smooth surface.

    Those of bumps do not. Those of maps in tangent space do where the blue of an image or a constant is below 0.5.
    """
    normal = m.textures.get("normal")
    if normal is None:
        return 0
    nodes = list(nodes_of(normal))
    mapped = m.normal_space != "WORLD" or any(isinstance(node, NormalMap) for node in nodes)
    if not mapped:
        return 0 if any(isinstance(node, (Bump, DisplacedBump)) for node in nodes) else NORMAL_BELOW
    if isinstance(normal, Combine) and isinstance(normal.z, float) and normal.z < 0.5:
        return NORMAL_BELOW
    read = images_of(normal) & images.keys()
    for name in read - least_blue.keys():
        pixels = images[name].pixels
        least_blue[name] = float(pixels[..., min(2, pixels.shape[2] - 1)].min())
    return NORMAL_BELOW if any(least_blue[name] < 0.5 for name in read) else 0
