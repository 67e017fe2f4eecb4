"""The terms of a derivative in a given scene: which can be non-zero, over how many edges, and why."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..derivatives.motion import STRENGTH, Motion
from ..derivatives.table_derivatives import requested_tables
from ..geometry.mesh_edges import MeshEdges
from ..geometry.placed_meshes import Pair, PlacedMeshes
from ..geometry.shape import convex, hide_nothing
from ..reference.simplify import indirect_obstacles, obstacles
from ..rendering.options import TERMS
from ..scene import parameters
from ..scene.light import AreaLight, PointLight, SpotLight, SunLight
from ..scene.material import Material, Mixture
from ..scene.names import MOST_NAMED, MOST_SENTENCES, listed
from ..scene.scene import Scene
from ..tables.materials import LAMBERTIAN, NORMAL_MAP, TRANSPARENCY, flags
from ..tables.tables import Tables
from .contact import touching_meshes
from .curves import has_outline, light_curves, missing_curves, missing_glare, surface_curves
from .fixed_direction_light import HeldLight, held_light, lets_light_pass
from .primary import edge_count, mesh_edges, missing_jumps, primary_rules
from .rims import rim_rule
from .shadow import bent_meshes, horizon_rule, missing_shadows
from .specular import aimed_materials, mirrored_light, mirrored_shadows, specular_rule
from .transparent_surfaces import changing_shares, missing_shares

UNREAD = "nothing of the picture reads it"
NOT_COMPUTED = "not computed in this scene, see below"
# Derivatives by these alone sample the lobes that they shape (native/shading/bsdf/favoured_lobes.h).
_WIDTHS = ("roughness", "coat_roughness")
_LIGHTS = ((AreaLight, "area lights"), (PointLight, "point lights"), (SpotLight, "spots"), (SunLight, "suns"))


@dataclass(frozen=True)
class Term:
    """One term of the derivative.

    Attributes
    ----------
    name
        As in `edgegrad.TERMS`.
    computed
        False: it is zero in this scene, or left out of it (`NOT_COMPUTED` in `why`).
    edges, of
        Candidate edges, and all edges (of the meshes that rays can hit); 0 for the interior.
    why
        What is computed or skipped, and the reason, in words.
    zero
        Of the interior: the parameters by which it is zero, and why.
    """

    name: str
    computed: bool
    edges: int
    of: int
    why: tuple[str, ...]
    zero: Mapping[str, str] = field(default_factory=dict, repr=False)


def terms(
    scene: Scene, tables: Tables, wrt: Sequence[str], moves: Motion, max_depth: int, placed: PlacedMeshes | None = None
) -> tuple[Term, ...]:
    """The terms of the derivative with respect to `wrt`, in the order of `edgegrad.TERMS`."""
    placed = PlacedMeshes.of(scene) if placed is None else placed
    edges = mesh_edges(scene, placed)
    primary = primary_rules(scene, placed, edges, moves, wrt)
    specular = specular_rule(scene, moves, wrt, max_depth)
    why = primary.why if specular is None else (*primary.why, specular)
    held = held_light(scene, moves, wrt) if max_depth >= 2 else HeldLight()
    touching = touching_meshes(scene, moves, held, max_depth)
    made = {
        "interior": _interior(scene, tables, wrt, moves, max_depth, held,
                              placed.close(touching.receivers, touching.givers)),
        "primary": Term("primary", primary.computed or specular is not None, primary.edges, primary.of, why),
        "shadow": _shadow(scene, placed, moves, edges, max_depth, mirrored_shadows(scene, moves, wrt, max_depth), held,
                          tuple(light_curves(scene, placed, moves, bool(touching)))),
        "indirect": _indirect(scene, placed, moves, edges, max_depth, mirrored_light(scene, moves, wrt, max_depth),
                              tuple(surface_curves(placed, moves, bool(touching)))),
    }
    return tuple(made[name] for name in TERMS)


def _interior(
    scene: Scene, tables: Tables, wrt: Sequence[str], moves: Motion, max_depth: int, held: HeldLight,
    close: list[Pair],
) -> Term:  # fmt: skip
    if _looks_the_same(scene, wrt):
        alone = next(iter(scene.meshes))
        words = f"'{alone}' is alone, convex and under an even sky: it looks the same from everywhere"
        return Term("interior", False, 0, 0, (words,), dict.fromkeys(wrt, words))
    if held.alone:
        words = f"of what {listed(held.meshes)} light only the outline changes: the shadow term has it"
        return Term("interior", False, 0, 0, (f"zero, since {words}",), dict.fromkeys(wrt, words))
    lit = frozenset(reflecting(scene))
    why: list[str] = []
    unchanged: dict[str, str] = {}
    computed, unnamed = False, [0, 0]
    for path in wrt:
        collection, name, fieldname = parameters.split(path)
        if not requested_tables(scene, tables, [path]):
            zero, words = True, f"'{path}': zero, since {UNREAD}"
        elif collection == "meshes" and fieldname in ("vertices", "transform", "instances"):
            what = f"vertices of '{name}'" if fieldname == "vertices" else f"'{path}'"
            zero, words = _moved(scene, name, what, lit, max_depth)
        elif collection == "camera":
            zero, words = False, f"'{path}': what each pixel sees slides over surfaces and sky"
        else:
            zero, words = _revalued(scene, path, lit, max_depth)
        computed |= not zero
        if zero:
            unchanged[path] = words.partition("zero, since ")[2]
        if len(why) < MOST_SENTENCES:
            why.append(words)
        else:
            unnamed[zero] += 1
    if any(unnamed):
        why.append(f"and {sum(unnamed):,} other parameters, by {unnamed[True]:,} of which it is zero")
    if computed and (met := _met_alone(scene, wrt)):
        why.append(f"only paths that meet {met} are recorded")
    rims = rim_rule(scene, moves, wrt, max_depth)
    if computed and rims is not None:
        why.append(rims)
    shares = changing_shares(scene, wrt, moves)
    if computed and shares is not None:
        why.append(shares)
    if computed and close:
        names = listed([f"'{one}' and '{other}'" for one, other in close])
        why.append(f"between {names} light keeps its direction where they nearly touch: noise stays finite there")
    if computed and all(path.startswith("materials.") and path.rpartition(".")[2] in _WIDTHS for path in wrt):
        why.append("only how wide lobes are is asked for: these lobes get most of the samples, and more where the "
                   "derivative is large")  # fmt: skip
    return Term("interior", computed, 0, 0, tuple(why), unchanged)


def _looks_the_same(scene: Scene, wrt: Sequence[str]) -> bool:
    """Whether only motion is asked for, of a lone flat Lambertian convex body in one colour under a constant sky."""
    moving = ("vertices", "transform")
    if not all(path.startswith("camera.") or path.endswith(moving) for path in wrt) or len(scene.meshes) != 1:
        return False
    name, mesh = next(iter(scene.meshes.items()))
    closures = _closures(scene, name)
    kind = flags(closures[0])
    opaque = kind & LAMBERTIAN and not kind & (TRANSPARENCY | NORMAL_MAP)
    plain = len(closures) == 1 and opaque and not closures[0].textures and not closures[0].emission.any()
    return bool(
        plain and not scene.lights and scene.world.image is None and mesh.smoothing is None and mesh.instances is None
        and _single(scene) and convex(mesh)
    )


def _moved(scene: Scene, name: str, what: str, lit: Collection[str], max_depth: int) -> tuple[bool, str]:
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
    (`asked_surfaces` in native/engine/interior_rules.cpp).
    """
    asked = [parameters.split(path) for path in wrt]
    names = list(dict.fromkeys(name for _, name, _ in asked))
    if any((collection, field) != ("meshes", "vertices") for collection, _, field in asked):
        return ""
    if lets_light_pass(scene) or len(names) == len(scene.meshes) or any(scene.emits(name) for name in names):
        return ""
    quoted = [f"'{name}'" for name in names]
    return listed(quoted) if len(quoted) > MOST_NAMED else " or ".join(quoted)


def _revalued(scene: Scene, path: str, lit: Collection[str], max_depth: int) -> tuple[bool, str]:
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


def _shadow(
    scene: Scene, placed: PlacedMeshes, moves: Motion, edges: dict[str, MeshEdges], max_depth: int,
    mirrored: str | None, held: HeldLight, curves: tuple[str, ...],
) -> Term:
    total = sum(e.count for e in edges.values())
    zero = ""
    if max_depth < 2:
        zero = "only light seen directly is rendered, and it has no shadows"
    elif not moves.any and mirrored is None:
        zero = "no vertex is a parameter and lights stand still: no shadow moves"
    elif not reflecting(scene):
        zero = "every surface is black: nothing shows a shadow"
    if zero:
        return Term("shadow", False, 0, total, (zero,))
    if not moves.any:
        still = "no shadow moves, but where it is seen by mirrors and smooth glass does"
        return Term("shadow", True, 0, total, (still, str(mirrored)))
    cut, horizons = horizon_rule(scene, moves, max_depth)
    # Seen through a body's far side, from within, borders of what lets light pass lie anywhere on it.
    if len(edges) == 1 and _single(scene) and not lets_light_pass(scene) and convex(next(iter(scene.meshes.values()))):
        alone = f"'{next(iter(edges))}' is alone and convex: it hides no light from itself"
        return Term("shadow", cut or bool(curves), 0, total, (alone, *((horizons,) if cut else ()), *curves))
    kept = total - sum(e.flat for e in edges.values())
    why = ["edges of all meshes, since a shadow also moves over a moving surface when its caster stands still"]
    if total - kept:
        why.append(f"skipped: {edge_count(total - kept)} between two faces of one plane, never a silhouette")
    why += [*([] if mirrored is None else [mirrored]), horizons, *curves]
    if held.meshes:
        why.append(f"besides: the outlines of {listed(held.meshes)}, as surfaces of {listed(held.materials)} see "
                   "them: in sharp lobes the direction of light is held, and the interior has none of its motion")
    absent = [words for kind, words in _LIGHTS if not any(isinstance(light, kind) for light in scene.lights.values())]
    if not np.any(scene.world.color * scene.world.strength):
        absent.append("environment")
    if not scene.emitters:
        absent.append("emissive meshes")
    if absent:
        why.append(f"no shadows of {', '.join(absent)}: there are none")
    return Term("shadow", kept > 0 or cut or bool(curves), kept, total, tuple(why))


def _indirect(
    scene: Scene, placed: PlacedMeshes, moves: Motion, edges: dict[str, MeshEdges], max_depth: int,
    mirrored: str | None, curves: tuple[str, ...],
) -> Term:
    total = sum(e.count for e in edges.values())
    kept = total - sum(e.flat for e in edges.values())
    zero = ""
    if max_depth < 3:
        zero = "light that surfaces pass on to each other is not rendered"
    elif not moves.meshes and not moves.camera and mirrored is None:
        zero = "no vertex is a parameter and the camera stands still: what surfaces see of each other stays"
    elif not reflecting(scene):
        zero = "every surface is black: none passes light on"
    # Quads of a smooth body may fold as they move: their halves then hide light in each other's planes, which counts.
    elif len(placed) <= 2 and not (lets_light_pass(scene) or bent_meshes(scene)) and hide_nothing(
        list(placed.values())
    ):
        names = " and ".join(repr(name) for name in placed)
        zero = (f"{names} is alone and convex: it doesn't light itself" if len(placed) == 1 else
                f"{names} are convex and apart: nothing is between any two surfaces")
    elif not kept and not curves:
        zero = "every edge is between two faces of one plane, never a silhouette"
    if zero:
        return Term("indirect", False, 0, total, (zero,))
    if next(indirect_obstacles(scene), None) is not None:
        return Term("indirect", False, 0, total, (NOT_COMPUTED,))
    if not moves.meshes and not moves.camera:
        still = "what surfaces see of each other stays, but where it is seen by mirrors and smooth glass moves"
        return Term("indirect", True, 0, total, (still, str(mirrored)))
    why = ["edges of all meshes: what they hide of one surface from another, at any bounce"]
    if total - kept:
        why.append(f"skipped: {edge_count(total - kept)} between two faces of one plane, never a silhouette")
    why += [*([] if mirrored is None else [mirrored]), *curves]
    aimed = aimed_materials(scene)
    if aimed:
        why.append(f"seen in sharp lobes ({listed(aimed)}) by samples that start at the camera, elsewhere at edges")
    if max_depth == 3:
        why.append("no chains of surfaces besides: paths of three segments have none")
    return Term("indirect", True, kept, total, tuple(why))


def missing(
    scene: Scene, moves: Motion, max_depth: int, narrow: bool, placed: PlacedMeshes | None = None
) -> tuple[str, ...]:
    """Sentences on what may not be zero and isn't computed; `narrow`: by engines for flat, diffuse scenes alone."""
    placed = PlacedMeshes.of(scene) if placed is None else placed
    if not narrow:
        return tuple(_uncomputed(scene, placed, moves, max_depth))
    out = [f"for exact derivatives the scene is too rich: {simplified}" for simplified in obstacles(scene)]
    out += missing_jumps(scene, placed, moves)
    if max_depth >= 2 and reflecting(scene):
        out.append("light that surfaces pass on to each other (more than one bounce): neither rendered nor derived")
    return tuple(out)


def _uncomputed(scene: Scene, placed: PlacedMeshes, moves: Motion, max_depth: int) -> Iterator[str]:
    """Boundaries that no term has, of an engine that differentiates every table."""
    yield from missing_jumps(scene, placed, moves)
    yield from missing_curves(scene, placed, moves)
    lit = reflecting(scene) if moves.any and max_depth >= 2 else []
    if not lit:
        return
    yield from missing_shadows(scene, moves)
    yield from missing_glare(scene, placed, moves, lit)
    yield from missing_shares(scene, moves)
    stands = next(indirect_obstacles(scene), None)
    if max_depth > 2 and (moves.meshes or moves.camera) and stands is not None:
        yield f"indirect boundary: edges between two surfaces that light each other are left out, since {stands}"


def _is_used(scene: Scene, material: str) -> bool:
    """Whether a face has the material, or a mixture that it is a part of."""
    return any(name == material or (isinstance(mixed := scene.materials[name], Mixture) and material in mixed.parts)
               for name in scene.used_materials)


def _closures(scene: Scene, mesh_name: str) -> list[Material]:
    return [closure for name in scene.meshes[mesh_name].used_materials for closure in scene.closures(name)]


def reflecting(scene: Scene) -> list[str]:
    """Names of the meshes that aren't black all over."""
    return scene.meshes_with([name for name in scene.materials if any(map(_reflects, scene.closures(name)))])


def _reflects(closure: Material) -> bool:
    colored = "base_color" in closure.textures or bool(np.any(closure.base_color > 0.0))
    return colored or not flags(closure) & LAMBERTIAN


def _varies(scene: Scene, mesh_name: str) -> bool:
    """Whether the mesh's own radiance differs from place to place."""
    mixed = any(scene.materials[name].textures for name in scene.meshes[mesh_name].used_materials
                if isinstance(scene.materials[name], Mixture))
    return mixed or any(not {"emission", "alpha"}.isdisjoint(c.textures) for c in _closures(scene, mesh_name))


def _single(scene: Scene) -> bool:
    """Whether the only mesh is drawn once."""
    return all(mesh.instances is None or len(mesh.instances) == 1 for mesh in scene.meshes.values())
