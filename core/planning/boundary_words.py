"""The engine's decisions on the boundary terms, in words."""

from __future__ import annotations

import numpy as np

from ..derivatives.decisions import Decision
from ..scene.light import AreaLight, PointLight, SpotLight, SunLight, has_size
from ..scene.names import listed
from .scene_words import SceneWords
from .term import NOT_COMPUTED, Term

_LIGHTS = ((AreaLight, "area lights"), (PointLight, "point lights"), (SpotLight, "spots"), (SunLight, "suns"))
_FLAT_SILHOUETTE = "between two faces of one plane, never a silhouette"


def edge_count(edges: int) -> str:
    """Return a number of edges in words."""
    return f"{edges:,} edge{'' if edges == 1 else 's'}"


def _mirrors(words: SceneWords, part: str) -> str:
    """Return the mirrors by which the camera sees a part's edges, in words; "": the part is zero."""
    found = words.computed(part)
    if found is None:
        return ""
    followed = words.computed("followed lobes")
    by = [f"mirrors and smooth glass ({words.material_names(found)})"] if found.materials else []
    if followed is not None:
        by.append(f"lobes nearly as narrow ({words.material_names(followed)})")
    return " and ".join(by)


def _any(words: SceneWords, *parts: str) -> bool:
    return any(words.computed(part) is not None for part in parts)


def primary(words: SceneWords) -> Term:
    """The primary term."""
    edges = words.by_part["edges"]
    mirrors = _mirrors(words, "mirrored edges")
    seen = words.sentence("light outlines", "besides edges: the outlines of {lights}")
    seen += words.sentence("field outlines", "besides edges: the outlines of the distance fields {meshes}")
    bands = words.by_part.get("field bands")
    if bands is not None and bands.computed:
        seen.append(f"besides edges: the outlines of the distance fields {words.mesh_names(bands)}, from bands about "
                    "them (field_edges)")
    elif bands is not None and bands.reason == "outlines serve":
        seen.append(f"the outlines of the distance fields {words.mesh_names(bands)} are sampled, whatever field_edges: "
                    "panoramas have no other estimator, and a warped picture has none for mirrors, glass, fields that "
                    "light may travel in, fields that may meet, and what the camera's own motion changes")
    seen += words.pairs("field crossings", "besides edges: the curves where {} pass through each other")
    seen += words.sentence("texture borders",
                           "besides edges: the borders within the faces of {meshes} at which textures jump")
    seen += words.pierced("intersection outlines",
                          "besides edges: the lines where {meshes} pass through the light '{light}'")
    if mirrors:
        seen.append(f"besides: all edges that the camera sees by {mirrors}")
    shown = words.computed("mirrored outlines")
    if shown is not None:
        seen.append(f"besides edges: the outlines of {words.light_names(shown)} that the camera sees by "
                    f"{_mirrors(words, 'mirrored outlines')}")
    computed = edges.computed or bool(seen)
    if edges.reason == "still":
        still = "no vertex is a parameter and the camera stands still"
        return Term("primary", computed, 0, edges.edges.of, (still, *seen))
    why = [f"moving meshes: {len(edges.meshes)} of {len(words.meshes)} ({words.mesh_names(edges)})"
           if edges.meshes else "the camera moves, and so do all edges on its picture"]
    counts = edges.edges
    unseen = words.by_part.get("unseen meshes")
    if counts.still:
        why.append(f"skipped: {edge_count(counts.still)} of meshes that stand still")
    if unseen is not None and unseen.meshes:
        why.append(f"skipped: {edge_count(unseen.edges.still)} of meshes that camera rays cannot hit "
                   f"({words.mesh_names(unseen)})")
    if counts.flat:
        why.append(f"skipped: {edge_count(counts.flat)} between two faces of one plane and one material, where nothing "
                   "jumps")
    if counts.seams:
        why.append(f"kept: {edge_count(counts.seams)} inside of one plane where normals or attributes of a textured "
                   "material jump")
    if edges.reason == "out of view":
        why.append("zero: the camera sees none of them")
    why += words.pairs("seen intersections", "besides edges: the lines where {} pass through each other")
    return Term("primary", computed, counts.kept, counts.of, (*why, *seen))


def shadow(words: SceneWords) -> Term:
    """The shadow term."""
    kinds = [words.by_part[part] for part in ("light shadows", "environment shadows") if part in words.by_part]
    first = kinds[0]
    curves = _shadow_curves(words)
    horizons = words.computed("horizons")
    mirrors = _mirrors(words, "mirrored shadows")
    of, kept = first.edges.of, max(d.edges.kept for d in kinds)
    computed = any(d.computed for d in kinds) or horizons is not None or bool(curves) or bool(mirrors) or _any(
        words, "emitter outlines", "field shadows")
    zero = {
        "not rendered": "only light seen directly is rendered, and it has no shadows",
        "still": "no vertex is a parameter and lights stand still: no shadow moves",
        "black": "every surface is black: nothing shows a shadow",
        "alone": f"'{words.meshes[0] if words.meshes else ''}' is alone and convex: it hides no light from itself",
    }.get(first.reason)
    horizon = _horizon_words(words)
    if zero is not None and first.reason != "alone" and mirrors:
        still = "no shadow moves, but its image in mirrors and smooth glass does"
        return Term("shadow", computed, 0, of, (still, f"besides: those that the camera sees by {mirrors}"))
    if zero is not None:
        return Term("shadow", computed, 0, of, (zero, *((horizon,) if horizons is not None else ()), *curves))
    why = ["edges of all meshes, since a shadow also moves over a moving surface when its caster stands still"]
    flat = max(d.edges.flat for d in kinds)
    if flat:
        why.append(f"skipped: {edge_count(flat)} {_FLAT_SILHOUETTE}")
    if mirrors:
        why.append(f"besides: those that the camera sees by {mirrors}")
    why += [*([horizon] if horizon else []), *curves]
    why += words.sentence("emitter outlines", "besides: the outlines of {meshes}, as surfaces of {materials} see "
                          "them: light in sharp lobes has a fixed direction, so the interior term does not contain its "
                          "motion")
    sampled = words.computed("camera-sampled shadows")
    if sampled is not None and sampled.materials:
        but = "lights without size" if sampled.meshes else "emissive meshes and lights without size"
        why.append(f"those that the camera sees by sharp lobes ({words.material_names(sampled)}): by samples that "
                   f"start at the camera, except for {but}")
    absent = _absent_lights(words)
    if absent:
        why.append(f"no shadows of {', '.join(absent)}: there are none")
    return Term("shadow", computed, kept, of, tuple(why))


def _absent_lights(words: SceneWords) -> list[str]:
    scene = words.scene
    absent = [name for kind, name in _LIGHTS if not any(isinstance(light, kind) for light in scene.lights.values())]
    if not np.any(scene.world.color * scene.world.strength):
        absent.append("environment")
    return absent if words.emissive else [*absent, "emissive meshes"]


def _shadow_curves(words: SceneWords) -> list[str]:
    out = words.pairs("light intersections", "besides edges: what {} hide of each other's light where they pass "
                      "through each other")
    for part in ("light intersections", "disk intersections"):
        out += words.pierced(part, "besides edges: what {meshes} hide of the light '{light}' where they pass through "
                             "it")
    out += words.pairs("crossed lights", "besides edges: what {} hide of each other's light where they pass through "
                       "each other")
    out += words.sentence("field shadows", "besides edges: the shadows of the distance fields {meshes}")
    out += words.sentence("cone borders", "besides edges: the borders of the cones of {lights}, which have no blend")
    return out


def _horizon_words(words: SceneWords) -> str:
    found = words.by_part.get("horizons")
    if found is None or found.reason == "not rendered":
        return ""
    if not found.computed:
        return {"none": "skipped: horizons, since no mesh is shaded with other normals than those of its faces",
                "pointlike": "skipped: horizons, since all lights are without size: they reach all of a face or none "
                             "of it"}.get(found.reason,
                                          "skipped: horizons, since neither surfaces nor what lights them moves")
    scene = words.scene
    sized = [name for name, light in scene.lights.items() if has_size(light)]
    lit = [f"the lights {listed(sized)}"] if sized else []
    if words.emissive:
        lit.append("emissive meshes")
    if np.any(scene.world.color * scene.world.strength):
        lit.append("the environment")
    of = " and ".join([", ".join(lit[:-1]), lit[-1]] if lit[1:] else lit)
    return (f"besides edges: the horizons of the faces of {words.mesh_names(found)}, where they cut off light of {of}")


def indirect(words: SceneWords, max_depth: int) -> Term:
    """The indirect term."""
    edges = words.by_part["edges between surfaces"]
    mirrors = _mirrors(words, "mirrored light")
    curves = words.pairs("surface intersections", "besides edges: the lines where {} pass through each other")
    curves += words.pairs("crossed surfaces", "besides edges: the curves where {} pass through each other")
    borders = words.computed("contact borders")
    if borders is not None:
        curves.append(f"besides: {edge_count(borders.edges.kept)} between faces, since light of a fixed direction "
                      "moves over them where surfaces nearly touch")
    curves += words.sentence("indirect horizons", "besides edges: the horizons of the faces of {meshes}, where they "
                             "cut off light of other surfaces")
    curves += words.sentence("fields between surfaces",
                             "besides edges: what the distance fields {meshes} hide of one surface from another")
    curves += _caustic_words(words)
    computed = edges.computed or bool(curves) or bool(mirrors)
    of = edges.edges.of
    if edges.outcome == "missing":
        return Term("indirect", False, 0, of, (NOT_COMPUTED,))
    if not computed:
        return Term("indirect", False, 0, of, (_indirect_zero(words, edges),))
    if edges.reason in ("nothing between", "black"):
        return Term("indirect", True, 0, of, (_indirect_zero(words, edges), *curves))
    if edges.reason == "still":
        still = "light between surfaces does not change, but its image in mirrors and smooth glass moves"
        seen = [f"besides: those that the camera sees by {mirrors}"] if mirrors else []
        return Term("indirect", True, 0, of, (still if mirrors else _indirect_zero(words, edges), *seen, *curves))
    why = ["edges of all meshes: what they hide of one surface from another, at any bounce"]
    if edges.edges.flat:
        why.append(f"skipped: {edge_count(edges.edges.flat)} {_FLAT_SILHOUETTE}")
    if mirrors:
        why.append(f"besides: those that the camera sees by {mirrors}")
    why += curves
    why += words.sentence("camera-sampled edges", "seen in sharp lobes ({materials}) by samples that start at the "
                          "camera, elsewhere at edges")
    if max_depth == 3:
        why.append("paths of three segments have no further surfaces")
    return Term("indirect", True, edges.edges.kept, of, tuple(why))


def _caustic_words(words: SceneWords) -> list[str]:
    """What is computed of light that mirrors, smooth glass and narrow lobes throw on other surfaces."""
    outlines, edges = words.computed("caustic outlines"), words.computed("caustic edges")
    jumps = [*(["edges"] if edges is not None else []),
             *([f"the outlines of {words.light_names(outlines)}"] if outlines is not None else [])]
    shown = outlines if edges is None else edges
    if shown is None:
        return []
    return [f"besides: {' and '.join(jumps)} in light that mirrors, smooth glass and lobes nearly as narrow "
            f"({words.material_names(shown)}) throw on other surfaces"]


def _indirect_zero(words: SceneWords, edges: Decision) -> str:
    names = " and ".join(repr(name) for name in words.meshes)
    between = (f"{names} is alone and convex: it doesn't light itself" if len(words.meshes) == 1 else
               f"{names} are convex and apart: nothing is between any two surfaces")
    return {
        "not rendered": "light that surfaces pass on to each other is not rendered",
        "still": "no vertex is a parameter and the camera stands still: what surfaces see of each other stays",
        "black": "every surface is black: none passes light on",
        "nothing between": between,
    }.get(edges.reason, "every edge is between two faces of one plane, never a silhouette")
