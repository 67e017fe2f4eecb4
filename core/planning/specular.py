"""What the specular boundary of a scene consists of, in words: edges that the camera sees in mirrors and through glass,
those of shadows there, and those between a surface seen there and others that light it.

The native engine follows the same rules (``native/engine/terms/specular_term.cpp``).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

from ..scene import parameters
from ..scene.light import Light, SpotLight, has_size
from ..scene.material import Material, Mixture
from ..scene.names import listed
from ..scene.scene import Scene
from ..tables.lights import LEAST_BLEND
from ..tables.materials import GLOSSY, REFRACTION, flags

if TYPE_CHECKING:
    from ..derivatives.motion import Motion

# Shaders of less roughness are taken for perfectly smooth (native/shading/bsdf/microfacet.h).
_SMOOTH = 4e-3
# Up to which alpha (roughness squared) lobes are sampled from the camera
# (native/boundary/segment/camera_sampled_lobes.h), and what part of that of glosses over diffuse bases.
_AIMED, _WEAK_GLOSS = 0.25, 0.25
# Up to which alpha lobes are followed as perfect ones are, where meshes give light and elsewhere
# (native/engine/followed_lobes_rule.cpp).
_FOLLOWED_BY_EMITTERS, _FOLLOWED = 0.0205, 0.0905
# Most surfaces that a chain of mirrors and glass meets (native/tasks/scan_task.h).
_LONGEST = 16


def specular_materials(scene: Scene) -> list[str]:
    """Names of the materials of some mesh that may be perfect mirrors or smooth glass somewhere."""
    return _used(scene, may_be_specular)


def may_be_specular(closure: Material) -> bool:
    """Whether a shader may be a perfect mirror or smooth glass somewhere."""
    if not flags(closure) & (GLOSSY | REFRACTION):
        return False
    coat = closure.kind == "PRINCIPLED" and (closure.coat_weight > 0.0 or "coat_weight" in closure.textures)
    return _may_be_smooth(closure, "roughness") or (coat and _may_be_smooth(closure, "coat_roughness"))


def _may_be_smooth(closure: Material, field: str) -> bool:
    return field in closure.textures or getattr(closure, field) < _SMOOTH


def followed_materials(scene: Scene) -> list[str]:
    """Names of the materials of some mesh with lobes so narrow that they are followed as mirrors and smooth glass are.

    Surfaces that pass through each other or through lights, which the engine looks for, keep them from it.
    """
    widest = _FOLLOWED_BY_EMITTERS if scene.emitters else _FOLLOWED
    names = _used(scene, lambda closure: _may_be_followed(closure, widest))
    if not names:
        return []
    textured = any(closure.textures for name in scene.used_materials for closure in scene.closures(name))
    smooth = any(mesh.smoothing is not None for mesh in scene.meshes.values())
    return [] if textured or any(_jumps(light, smooth) for light in scene.lights.values()) else names


def _may_be_followed(closure: Material, widest: float) -> bool:
    if closure.kind in ("REFRACTION", "DISNEY", "SHEEN") or not flags(closure) & (GLOSSY | REFRACTION):
        return False
    coat = closure.kind == "PRINCIPLED" and closure.coat_weight > 0.0
    return 0.0 < closure.roughness**2 <= widest or (coat and 0.0 < closure.coat_roughness**2 <= widest)


def _jumps(light: Light, smooth: bool) -> bool:
    """Whether a light ends within faces: a spot without blend, or one without size that smooth faces turn from."""
    return (smooth and not has_size(light)) or (isinstance(light, SpotLight) and light.blend < LEAST_BLEND)


def aimed_materials(scene: Scene) -> list[str]:
    """Names of the materials of some mesh in whose sharp lobes edges are found by samples that start at the camera."""
    return _used(scene, _may_be_aimed)


def _used(scene: Scene, test: Callable[[Material], bool]) -> list[str]:
    found = [name for name in scene.materials if any(map(test, scene.closures(name)))]
    if not found:
        return []  # most scenes: their meshes needn't be looked at
    used = set(scene.used_materials)
    return [name for name in found if name in used]


def _may_be_aimed(closure: Material) -> bool:
    scatters = bool(flags(closure) & (GLOSSY | REFRACTION)) and closure.kind != "SHEEN"
    textured = not {"roughness", "coat_roughness"}.isdisjoint(closure.textures)
    return scatters and (sharp_lobe(closure, _AIMED) or textured)


def sharp_lobe(closure: Material, widest: float) -> bool:
    """Whether a shader has a lobe, not perfect, of an alpha up to `widest`, of a gloss over a diffuse base less."""
    if not flags(closure) & (GLOSSY | REFRACTION) or closure.kind == "SHEEN":
        return False
    principled = closure.kind in ("PRINCIPLED", "DISNEY")
    textured = not {"metallic", "transmission"}.isdisjoint(closure.textures)
    strong = closure.metallic + closure.transmission >= 0.5 or textured
    widest *= _WEAK_GLOSS if principled and not strong else 1.0
    coat = principled and (closure.coat_weight > 0.0 or "coat_weight" in closure.textures)
    return bool(0.0 < closure.roughness**2 <= widest or (coat and 0.0 < closure.coat_roughness**2 <= widest))


def specular_rule(scene: Scene, moves: Motion, wrt: Sequence[str], max_depth: int) -> str | None:
    """What is computed of edges seen in mirrors and through glass; None: there is nothing of the kind."""
    if max_depth < 2 or not (moves.meshes or moves.camera or bends_rays(scene, wrt)):
        return None
    seen = _shown_by(scene, moves)
    return f"besides: all edges that the camera sees by {seen}" if seen else None


def mirrored_shadows(scene: Scene, moves: Motion, wrt: Sequence[str], max_depth: int) -> str | None:
    """What is computed of edges of shadows seen in mirrors and through glass; None: there is nothing of the kind."""
    seen = _shown_by(scene, moves)
    # By the camera's ray, the mirror's, and that of the light.
    return _seen_by(seen) if seen and max_depth > 2 and (moves.any or bends_rays(scene, wrt)) else None


def mirrored_light(scene: Scene, moves: Motion, wrt: Sequence[str], max_depth: int) -> str | None:
    """The same of edges between a surface seen in mirrors and through glass and others that light it."""
    seen = _shown_by(scene, moves)
    moved = bool(moves.meshes or moves.camera) or bends_rays(scene, wrt)
    return _seen_by(seen) if seen and max_depth > 3 and moved else None


def _followed(scene: Scene, moves: Motion) -> list[str]:
    return followed_materials(scene) if moves.meshes or moves.camera or moves.sky else []


def _shown_by(scene: Scene, moves: Motion) -> str:
    """By what the camera sees what scan lines find, in words."""
    smooth, followed = specular_materials(scene), _followed(scene, moves)
    words = [f"mirrors and smooth glass ({listed(smooth)})"] if smooth else []
    if followed:
        words.append(f"lobes nearly as narrow ({listed(followed)}), where no surfaces pass through others or lights")
    return " and ".join(words)


def _seen_by(words: str) -> str:
    return f"besides: those that the camera sees by {words}"


def missing_specular(scene: Scene, moves: Motion, wrt: Sequence[str], max_depth: int) -> Iterator[str]:
    """Sentences on what the camera may see in mirrors and through glass that has no derivative as it moves."""
    if specular_rule(scene, moves, wrt, max_depth) is None:
        return
    smooth, followed = specular_materials(scene), _followed(scene, moves)
    if followed:
        yield (f"seen in lobes nearly as narrow as a mirror's ({', '.join(followed)}): what is thinner than a quarter "
               "of a pixel in the picture may be missed")
    if not smooth:
        return
    yield ("seen in mirrors and through smooth glass: what is thinner than a quarter of a pixel in the picture may be "
           "missed; left out are lines where surfaces pass through each other or through lights, seams of textures "
           "inside of smooth surfaces, borders of spots without blend, and where faces of smooth-shaded meshes turn "
           "away from lights without size"
           + (f", and what chains of more than {_LONGEST} surfaces show" if max_depth > _LONGEST else ""))
    clear = [name for name in smooth
             if any(closure.kind == "REFRACTION" and may_be_specular(closure) for closure in scene.closures(name))]
    if clear:
        yield f"where Refraction shaders stop to let light through, since it is reflected totally ({listed(clear)})"


def missing_outlines(scene: Scene, moves: Motion, wrt: Sequence[str], max_depth: int) -> Iterator[str]:
    """A sentence on lights whose outlines move in what mirrors and smooth glass show to the camera."""
    if max_depth < 2 or not specular_materials(scene):
        return
    all_move = bool(moves.meshes or moves.camera) or bends_rays(scene, wrt)
    shown = [name for name, light in scene.lights.items()
             if (all_move or name in moves.lights) and has_size(light)
             and not {"glossy", "transmission"}.isdisjoint(light.visible_to)]
    if shown:
        yield f"the outlines of lights in mirrors and behind glass ({listed(shown)}): they are no edges"


def causes_caustics(scene: Scene, moves: Motion, wrt: Iterable[str], max_depth: int) -> list[str]:
    """Names of the materials that may throw caustics of which a derivative lacks the jumps; empty: there are none."""
    return specular_materials(scene) if max_depth > 2 and (moves.any or bends_rays(scene, wrt)) else []


def missing_caustics(materials: Sequence[str], share: float | None) -> str:
    """What derivatives lack of caustics, in words; `share`: how much of the picture they are, None: not measured."""
    much = "plan(…, measure=16) says how much of the picture they are" if share is None else (
        f"they are {share:.2g} of the picture" if share > 0.0 else "no path of the measurement met any")
    return (f"caustics: of light that mirrors and smooth glass ({', '.join(materials)}) throw on other surfaces, the "
            "edges and outlines of lights that those surfaces see there are left out: the derivative of this light may "
            f"be zero or have the wrong sign ({much})")


def bends_rays(scene: Scene, wrt: Iterable[str]) -> bool:
    """Whether `wrt` has a mirror's or smooth glass' index or normal map, what its textures read, or normals."""
    return asks_bending(scene, specular_materials(scene), wrt)


def asks_bending(scene: Scene, materials: list[str], wrt: Iterable[str]) -> bool:
    """Whether `wrt` has the index or normal map of one of the materials, what its textures read, or normals."""
    if not materials:
        return False
    mixed = [scene.materials[name] for name in materials]
    parts = {*materials, *(part for m in mixed if isinstance(m, Mixture) for part in m.parts)}
    textured = any(closure.textures for name in materials for closure in scene.closures(name))
    for path in wrt:
        collection, name, field = parameters.split(path)
        read = textured and (collection == "images" or field.startswith((parameters.ATTRIBUTES, parameters.TEXTURES)))
        bends = collection == "materials" and name in parts and field in ("ior", "normal", "normal_strength")
        if read or field == "normals" or bends:
            return True
    return False
