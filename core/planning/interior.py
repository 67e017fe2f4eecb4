"""The engine's decisions on the interior term, in words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import compress

from ..scene import parameters
from ..scene.names import MOST_NAMED, MOST_SENTENCES, listed
from .scene_words import SceneWords
from .term import UNREAD, Term

_ZERO = {
    "unread": UNREAD,
    "unused": "no face has this material, or a material that reads this texture",
    "not rendered": "only light seen directly is rendered, and it does not change",
    "unshaded": "it reflects no light, and no surface reflects light that it emits",
    "black": "every surface is black",
    "only outline moves": "only the outline of the light that it emits moves, which the shadow term covers",
}


def _zero(words: SceneWords, reason: str) -> str:
    if reason == "looks the same":
        return f"'{words.meshes[0]}' is alone, convex and in an even environment: it looks the same from everywhere"
    return _ZERO[reason]


def interior(words: SceneWords, wrt: Sequence[str]) -> Term:
    """The interior term."""
    shading = words.by_part["shading"]
    kinds, places = shading.by_parameter
    named = zip(wrt[:MOST_SENTENCES], (kinds[k][0] for k in places[:MOST_SENTENCES]), strict=True)
    why = [f"'{path}': " + (_change(path) if reason == "needed" else f"zero, since {_zero(words, reason)}")
           for path, reason in named]
    others = places[MOST_SENTENCES:]
    if others:
        zero = sum(others.count(k) for k, (reason, _) in enumerate(kinds) if reason != "needed")
        why.append(f"and {len(others):,} other parameters, by {zero:,} of which it is zero")
    if shading.computed:
        why += _computed(words)
    return Term("interior", shading.computed, 0, 0, tuple(why))


def unchanged(words: SceneWords, wrt: Sequence[str]) -> dict[str, str]:
    """Parameters that do not change the picture, and why."""
    kinds, places = words.by_part["shading"].by_parameter
    why = {k: _zero(words, reason) for k, (reason, stays) in enumerate(kinds) if stays}
    if not why:
        return {}
    stays = bytearray(256)
    for k in why:
        stays[k] = 1
    stay = places.translate(stays)
    paths = compress(wrt, stay)
    if len(why) == 1:
        return dict.fromkeys(paths, *why.values())
    return dict(zip(paths, map(why.__getitem__, compress(places, stay)), strict=True))


def _change(path: str) -> str:
    collection, _, field = parameters.split(path)
    if collection == "meshes" and field in ("vertices", "transform", "instances"):
        return "the mesh's shading, or the light that it emits, changes as it moves"
    if collection == "camera":
        return "the point that each pixel sees moves over surfaces and the environment"
    return "changes radiance"


def _computed(words: SceneWords) -> Iterator[str]:
    """Parts that are computed beside the shading, and how paths are chosen."""
    shading = words.by_part["shading"]
    count = len(shading.meshes) + len(shading.materials)
    if count and len(shading.meshes) < len(words.meshes):
        surfaces = [f"'{words.meshes[k]}'" for k in shading.meshes[:MOST_NAMED]]
        surfaces += [f"'{words.materials[k]}'" for k in shading.materials[:MOST_NAMED]]
        yield f"only paths that meet {listed(surfaces, count)} are recorded"
    rims = words.computed("rims")
    if rims is not None:
        yield f"besides: the directions beyond which lobes of {words.material_names(rims)} scatter no light"
    shares = words.computed("transparency")
    if shares is not None:
        yield (f"the transmittance of {words.material_names(shares)} changes, on the way to lights and between "
               "surfaces")
    contact = words.by_part.get("contact")
    if contact is not None and contact.materials:
        yield (f"noisy: where faces of {words.material_names(contact)} meet at concave corners or touch others, "
               "light between them has no finite variance, since these materials are transparent, mirror "
               "perfectly or have textures that jump")
    narrow = words.computed("sharp reflections")
    if narrow is not None:
        thrown = words.computed("caustic edges") or words.computed("caustic outlines")
        quiet = thrown is not None and set(narrow.materials) <= set(thrown.materials)
        but = (", except where it comes straight from lamps or the sky and the camera sees these surfaces directly"
               if quiet else "")
        yield (f"noisy: light that narrow lobes of {words.material_names(narrow)} throw on other surfaces, since "
               f"samples of its derivative are larger than this light by one over the lobes' width{but}; with perfect "
               "mirrors (roughness 0) or rougher lobes in their place, a fit has less noise")
    if words.computed("favoured lobes") is not None:
        yield ("only roughness is requested: the lobes that it shapes get most of the samples, and more where the "
               "derivative is large")
