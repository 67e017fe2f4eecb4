"""The interior term in words: by which parameters shading changes, and what is computed of it.

Which paths are recorded, and whether the whole term is zero, the engine decides; by parameters the words of this module
add why a derivative may be expected or not.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..derivatives.motion import STRENGTH
from ..derivatives.table_derivatives import requested_tables
from ..scene import parameters
from ..scene.light import has_outline
from ..scene.material import Material, Mixture
from ..scene.names import MOST_NAMED, MOST_SENTENCES, listed
from ..scene.scene import Scene
from ..tables.materials import LAMBERTIAN, TRANSPARENCY, flags
from ..tables.tables import Tables
from .scene_words import SceneWords
from .term import UNREAD, Term

# Derivatives by these alone sample the lobes that they shape (native/shading/bsdf/favoured_lobes.h).
_WIDTHS = ("roughness", "coat_roughness")


def interior(words: SceneWords, tables: Tables, wrt: Sequence[str], max_depth: int) -> Term:
    """The interior term."""
    scene = words.scene
    reason = words.reason("shading")
    if reason == "looks the same":
        why_zero = f"'{words.meshes[0]}' is alone, convex and in an even environment: it looks the same from everywhere"
        return Term("interior", False, 0, 0, (why_zero,), dict.fromkeys(wrt, why_zero))
    outlines = words.computed("emitter outlines")
    if reason == "only outline moves" and outlines is not None:
        why_zero = f"only the outline of what {words.mesh_names(outlines)} give moves; the shadow term covers it"
        return Term("interior", False, 0, 0, (f"zero: {why_zero}",), dict.fromkeys(wrt, why_zero))
    lit = Reflecting(scene)
    why: list[str] = []
    unchanged: dict[str, str] = {}
    unnamed = [0, 0]
    computed = False
    for path in wrt:
        zero, sentence = _by_parameter(scene, tables, path, lit, max_depth)
        computed |= not zero
        if zero:
            unchanged[path] = sentence.partition("zero, since ")[2]
        if len(why) < MOST_SENTENCES:
            why.append(sentence)
        else:
            unnamed[zero] += 1
    if any(unnamed):
        why.append(f"and {sum(unnamed):,} other parameters, by {unnamed[True]:,} of which it is zero")
    if computed:
        why += _computed(words, wrt)
    return Term("interior", computed, 0, 0, tuple(why), unchanged)


def _by_parameter(
    scene: Scene, tables: Tables, path: str, lit: Reflecting, max_depth: int
) -> tuple[bool, str]:
    """Whether the term is zero by one parameter, and that in words."""
    collection, name, fieldname = parameters.split(path)
    if not requested_tables(scene, tables, [path]):
        return True, f"'{path}': zero, since {UNREAD}"
    if collection == "meshes" and fieldname in ("vertices", "transform", "instances"):
        what = f"vertices of '{name}'" if fieldname == "vertices" else f"'{path}'"
        return _moved(scene, name, what, lit, max_depth)
    if collection == "camera":
        return False, f"'{path}': the point that each pixel sees moves over surfaces and the environment"
    return _revalued(scene, path, lit, max_depth)


def _computed(words: SceneWords, wrt: Sequence[str]) -> list[str]:
    """What is computed besides, and how."""
    out = []
    if met := _met_alone(words.scene, wrt):
        out.append(f"only paths that meet {met} are recorded")
    rims = words.computed("rims")
    if rims is not None:
        out.append(f"besides: the directions at which rough glass ({words.material_names(rims)}) stops to let light "
                   "through")
    shares = words.computed("transparency")
    if shares is not None:
        out.append(f"what {words.material_names(shares)} let through changes, on the way to lights and between "
                   "surfaces")
    concave = words.by_part.get("contact")
    if concave is not None and concave.materials:
        out.append(f"noisy: where faces of {words.material_names(concave)} meet at concave corners or touch others, "
                   "light between them has no finite variance, since these materials are transparent, mirror "
                   "perfectly or have textures that jump")
    if all(path.startswith("materials.") and path.rpartition(".")[2] in _WIDTHS for path in wrt):
        out.append("only how wide lobes are is requested: these lobes get most of the samples, and more where the "
                   "derivative is large")
    return out


def _moved(scene: Scene, name: str, what: str, lit: Reflecting, max_depth: int) -> tuple[bool, str]:
    """Whether moving a mesh changes no shading, and that in words."""
    if max_depth < 2 and not _varies(scene, name):
        return True, f"{what}: zero, since emission alone does not change as a surface moves"
    if name in lit or _varies(scene, name):
        return False, f"{what}: its shading changes as it moves and turns"
    if scene.emits(name) and lit:
        return False, f"{what}: it only emits, so its own radiance stays; the light it gives changes"
    return True, f"{what}: zero, since it {'emits and lights nothing' if scene.emits(name) else 'is black'}"


def _met_alone(scene: Scene, wrt: Sequence[str]) -> str:
    """Meshes that paths must meet for a derivative by their vertices, in words; "" if others may have one too.

    Light that a mesh gives falls everywhere, and what light passes through is part of what others scatter
    (`requested_surfaces` in native/engine/decisions/interior_rules.cpp).
    """
    asked = [parameters.split(path) for path in wrt]
    names = list(dict.fromkeys(name for _, name, _ in asked))
    if any((collection, field) != ("meshes", "vertices") for collection, _, field in asked):
        return ""
    others = len(scene.meshes) + len(scene.fields) - len(names)
    if _lets_light_pass(scene) or others == 0 or any(scene.emits(name) for name in names):
        return ""
    quoted = [f"'{name}'" for name in names]
    return listed(quoted) if len(quoted) > MOST_NAMED else " or ".join(quoted)


def _revalued(scene: Scene, path: str, lit: Reflecting, max_depth: int) -> tuple[bool, str]:
    """Whether a value that moves no edge changes nothing, and that in words."""
    collection, name, fieldname = parameters.split(path)
    # Layers above a surface's emission take a part of it.
    plain = fieldname.removeprefix(parameters.TEXTURES)
    glows = plain in ("emission", "alpha", "weights") or plain.startswith(("coat_", "sheen_"))
    if collection == "materials" and not _is_used(scene, name):
        return True, f"'{path}': zero, since no face has this material"
    shown = collection == "lights" and has_outline(scene.lights[name])
    if max_depth < 2 and not shown and (collection == "lights" or (collection == "materials" and not glows)):
        return True, f"'{path}': zero, since only light seen directly is rendered"
    if collection == "lights" and not lit and not shown:
        return True, f"'{path}': zero, since every surface is black"
    moving = collection == "lights" and fieldname not in STRENGTH
    return False, f"'{path}': changes radiance" + ("" if moving else " and moves no edge")


def _is_used(scene: Scene, material: str) -> bool:
    """Whether a face has the material, or a mixture that it is a part of."""
    return any(name == material or (isinstance(mixed := scene.materials[name], Mixture) and material in mixed.parts)
               for name in scene.used_materials)


def _closures(scene: Scene, mesh_name: str) -> list[Material]:
    return [closure for name in scene.meshes[mesh_name].used_materials for closure in scene.closures(name)]


class Reflecting:
    """The meshes that aren't black all over, each looked at when it is asked for: there may be very many."""

    def __init__(self, scene: Scene) -> None:
        self._meshes, self._fields = scene.meshes, scene.fields
        self._materials = {name for name in scene.materials if any(map(_reflects, scene.closures(name)))}

    def __contains__(self, name: str) -> bool:
        return not self._materials.isdisjoint(self._meshes[name].used_materials)

    def __bool__(self) -> bool:
        return any(name in self for name in self._meshes) or any(one.material in self._materials
                                                                 for one in self._fields.values())


def _reflects(closure: Material) -> bool:
    colored = "base_color" in closure.textures or bool(np.any(closure.base_color > 0.0))
    return colored or not flags(closure) & LAMBERTIAN


def _varies(scene: Scene, mesh_name: str) -> bool:
    """Whether the mesh's own radiance differs from place to place."""
    mixed = any(scene.materials[name].textures for name in scene.meshes[mesh_name].used_materials
                if isinstance(scene.materials[name], Mixture))
    return mixed or any(not {"emission", "alpha"}.isdisjoint(c.textures) for c in _closures(scene, mesh_name))


def _lets_light_pass(scene: Scene) -> bool:
    return any(flags(closure) & TRANSPARENCY for name in scene.materials for closure in scene.closures(name))
