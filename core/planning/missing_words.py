"""Contributions to a derivative that are not computed and may not be zero, in words."""

from __future__ import annotations

from .scene_words import SceneWords

# For each part a sentence with its meshes, lights or materials, and its limit.
_ABOUT_MESHES = {
    "self intersections": "surfaces that pass through themselves are left out in {}: meshes of more than {limit:,} "
                          "faces are not searched",
    "clip borders": "the borders that the camera's clip distances cut into {}: they are no edges",
    "texel borders": "borders within the faces of {} where their textures may jump: sampled are only straight ones "
                     "(checkerboards, images without interpolation, constant ramps, comparisons and hues of "
                     "UVs) on meshes, in moderate numbers",
    "partly seen shadows": "shadows of {}, which only some kinds of rays can hit: computed as for shadow rays, or as "
                           "for diffuse rays in an environment of one colour; they also depend on the densities of "
                           "samples, whose change is left out",
    "lit from below": "the edges of shadows on {}, where a light lies below the plane of a face that its smooth "
                      "normals let it reach (terminator_offset): they are not sampled",
    "field borders": "the borders where the distance fields {} end at their boxes: they are no edges",
    "parallel mirrors": "suns that appear or vanish at once on whole faces of {}, flat mirrors or glass that the "
                        "orthographic camera sees: at single values of the parameters the picture jumps",
    "thin fields": "the outlines and shadows of parts of the distance fields {} that are thinner than a cell, and "
                   "shadows on them: their grids are too large for a search; make the cells smaller",
    "edges between surfaces": "indirect boundary: edges between two surfaces that light each other are left out, since "
                              "some kinds of scattered rays can hit {} and others cannot",
}
_ABOUT_LIGHTS = {
    "blurred outlines": "the outlines of {}, suns or disks that an orthographic camera sees through its lens",
}
_ABOUT_MATERIALS = {
    "ray histories": "edges and shadows on {}, whose textures read bounces or lengths of rays: their boundary terms "
                     "count the last bounce only, and lengths as 0",
    "slid textures": "borders at which textures may jump, where they move over {}: they are no edges",
    "stepped shadows": "shadows of borders at which textures may make the transmittance of {} jump: they are no edges",
    "clear absorption": "how absorption in meshes with transparent surfaces ({}) changes with their shape, and its "
                        "shadows",
    "turned normals": "the borders where normals of {} begin to point away from the viewer, and for gloss also below "
                      "the surface: these materials scatter no light beyond",
    "narrow field lobes": "what distance fields hide of the light of narrow lobes ({}): hardly any sample finds it, so "
                          "that the derivative may lack it; make these surfaces rougher, or mirrors (roughness 0)",
    "total reflection": "borders of total reflection of Refraction shaders ({})",
}
_PIERCED = {
    "field lines": "the curves where the light '{light}' passes through the distance fields {meshes}",
    "parallel disks": "the outline of the light '{light}' where {meshes} pass through it: a disk that faces "
                      "parallel rays",
    "mirrored lines": "the lines where {meshes} pass through the light '{light}', in mirrors and behind glass",
    "light jumps": "how the light of '{light}' jumps on {meshes} just where they pass through it: its estimate has "
                   "infinite variance",
}


def missing(words: SceneWords, share: float | None) -> list[str]:
    """Return sentences on missing parts; `share`: fraction of the picture that is caustics, None: not measured."""
    out = []
    for part, decision in words.by_part.items():
        if decision.outcome != "missing":
            continue
        if part in _ABOUT_MESHES:
            out.append(_ABOUT_MESHES[part].format(words.mesh_names(decision), limit=decision.limit))
        elif part in _ABOUT_LIGHTS:
            out.append(_ABOUT_LIGHTS[part].format(words.light_names(decision)))
        elif part in _ABOUT_MATERIALS:
            out.append(_ABOUT_MATERIALS[part].format(words.material_names(decision)))
        elif part in _PIERCED:
            out += words.pierced(part, _PIERCED[part])
        elif part == "face flips":
            out.append(f"jumps where a light without size ({words.light_names(decision)}) passes the plane of a face "
                       f"of {words.mesh_names(decision)}: it reaches all of the face or none of it")
        elif part == "coincident faces":
            out += words.each_pair(decision.pairs, "what is seen of {} where their faces coincide: rounding decides "
                                                   "which one, so that borders there may be wrong, and it jumps as one "
                                                   "moves out of the other's plane")
            out += words.pierced(part, "whether faces of {meshes} hide the light '{light}', which lies in their plane: "
                                       "its light jumps as one moves out of the other's plane")
        elif part == "parting meshes":
            out += words.each_pair(decision.pairs, "how the picture changes as one of {} moves away from the other or "
                                                   "into it: they touch along edges or faces, so that only one-sided "
                                                   "derivatives exist, and what is computed may be neither of them")
        elif part == "wide lens":
            out.append("most of what edges seen through the lens contribute: its aperture is so much larger than its "
                       "distance of focus that nearly all of their samples miss the picture")
        elif part == "disc border":
            out.append("the border of the disc that the fisheye sees, beyond which the picture is black: it is no edge")
        elif part == "beyond poles":
            out.append("edges in the parts of the panorama beyond a pole (latitudes beyond 90 degrees)")
        elif part == "further shadows":
            of = [f"{words.light_names(decision)} (lights without size)"] if decision.lights else []
            if decision.meshes:
                of.append(f"{words.mesh_names(decision)} (emissive meshes, which some rays pass)")
            out.append(f"shadows of {' and '.join(of)} on surfaces that mirrors and smooth glass "
                       f"({words.material_names(decision)}) show to other surfaces, or that light those that the "
                       "camera sees by them")
        elif part == "media":
            named = words.material_names(decision) or "the world's"
            out.append(f"in media ({named}): how what they keep of the light changes with distances, and shadows and "
                       "edges in the light that they scatter")
        elif part == "rim lines":
            out.append(f"lines on {words.material_names(decision)} beyond which their lobes scatter no light "
                       f"of lights without size ({words.light_names(decision)})")
        elif part == "caustics":
            out.append(_caustics(words, words.material_names(decision), share))
    return [*_mirrored(words), *out]


def _mirrored(words: SceneWords) -> list[str]:
    edges = words.computed("mirrored edges")
    if edges is None:
        return []
    out = []
    followed = words.computed("followed lobes")
    if followed is not None:
        out.append(f"seen in lobes nearly as narrow as a mirror's ({words.material_names(followed)}): where several "
                   "features follow each other within a quarter of a pixel, some may be missed")
    if edges.materials:
        longest = words.by_part.get("long chains")
        out.append("seen in mirrors and through smooth glass: where several features follow each other within a "
                   "quarter of a pixel, some may be missed; left out are lines where lights pass through surfaces, "
                   "borders within faces at which textures jump, seams of textures inside of smooth surfaces, borders "
                   "of spots without blend, and where faces of smooth-shaded meshes turn away from lights without size"
                   + (f", and edges seen by chains of more than {longest.limit} surfaces" if longest else ""))
    return out


def _caustics(words: SceneWords, materials: str, share: float | None) -> str:
    much = "plan(…, measure=16) says how much of the picture they are" if share is None else (
        f"they are {share:.2g} of the picture" if share > 0.0 else "no path of the measurement met any")
    parts = [words.by_part.get(part) for part in ("caustic edges", "caustic outlines")]
    absent = next((part for part in parts if part is not None and part.outcome == "missing"), None)
    if absent is not None:
        why = (f"some kinds of scattered rays can hit {words.mesh_names(absent)} and others cannot"
               if absent.reason == "rays differ" else f"these have more than {absent.limit:,} faces")
        return (f"caustics: edges and outlines of lights are left out in light that mirrors and smooth glass "
                f"({materials}) throw on other surfaces, since {why}: the derivative of this light may be zero or have "
                f"the wrong sign ({much})")
    return (f"caustics, light that mirrors and smooth glass ({materials}) throw on other surfaces: left out are edges "
            "and outlines in those that are themselves seen in mirrors or through glass, horizons of smooth-shaded "
            "faces, and distance fields that are mirrors or glass or that such light passes; also lines where surfaces "
            "pass through each other or through lights, and what distance fields hide, in them and where the camera "
            f"sees by mirrors or glass what such surfaces light ({much})")
