"""The facts by which the engine skips work in pictures of a scene, in words."""

from __future__ import annotations

from collections.abc import Iterator

from ..scene.light import AreaLight, PointLight, SpotLight, SunLight
from ..scene.names import listed
from ..scene.scene import Scene
from ..tables.picture_facts import PictureFacts
from ..tables.tables import Tables

_KINDS = {AreaLight: "area light", PointLight: "point light", SpotLight: "spot", SunLight: "sun"}


def picture_plan(scene: Scene, tables: Tables, facts: PictureFacts, max_depth: int) -> tuple[str, ...]:
    """Return sentences on rays, shaders, textures, lights and environment."""
    return (*_rays(scene, facts, max_depth), *_shaders(scene, facts), *_textures(scene, tables), *_lights(scene, facts),
            _environment(scene, facts))


def _rays(scene: Scene, facts: PictureFacts, max_depth: int) -> Iterator[str]:
    copies = f", {_count(facts.instances, 'instance')} of them traced in place" if facts.instances else ""
    yield _count(facts.triangles, "triangle") + copies
    if scene.fields:
        cells = sum(int(one.cells.prod()) for one in scene.fields.values())
        yield f"{_count(len(scene.fields), 'distance field')} of {_count(cells, 'cell')}"
    if max_depth == 1:
        yield "one segment: only light seen directly, no surface is shaded"
    elif facts.lambertian:
        yield f"up to {max_depth} segments; the last is traced only where it can see the environment"
    else:
        yield f"up to {max_depth} segments"
    if facts.transparent:
        yield "shadow rays multiply the transmittances of surfaces"
    else:
        yield "no surface is transparent: shadow rays stop at the first hit"
    if facts.media:
        yield "media scatter or absorb light: each ray finds those along it by a second query"


def _shaders(scene: Scene, facts: PictureFacts) -> Iterator[str]:
    materials = list(scene.materials)
    kinds = sorted({closure.kind.capitalize() for row in facts.material_rows
                    for closure in scene.closures(materials[row])})
    if not kinds:
        return
    if facts.lambertian:
        yield "all surfaces are Lambertian: no microfacets, no light that only a mirror finds"
    else:
        parts = [word for occurs, word in ((facts.glossy, "reflection"), (facts.refracting, "refraction")) if occurs]
        yield f"shaders {', '.join(kinds)}" + (f", with {' and '.join(parts)}" if parts else "")
    if facts.flat:
        yield "all is shaded flat: no normals are interpolated"


def _textures(scene: Scene, tables: Tables) -> Iterator[str]:
    textured = tables.textures is not None
    count = sum(len(material.textures) for material in scene.materials.values()) if textured else 0
    yield f"{_count(count, 'textured value')}, from {_count(len(scene.images), 'image')}" if count else "no textures"


def _lights(scene: Scene, facts: PictureFacts) -> Iterator[str]:
    lights = list(scene.lights.items())
    sampled = [lights[row][1] for row in facts.sampled_rows]
    found = [_count(n, word) for kind, word in _KINDS.items() if (n := sum(isinstance(s, kind) for s in sampled))]
    if facts.emissive_triangles:
        found.append(_count(facts.emissive_triangles, "emissive triangle"))
    yield f"light is sampled from {', '.join(found)}" if found else "no light is sampled: there is none but the world's"
    dark = [name for row, (name, _) in enumerate(lights) if row not in set(facts.sampled_rows)]
    if dark:
        yield f"without power, left out: {listed(dark)}"


def _environment(scene: Scene, facts: PictureFacts) -> str:
    if not facts.environment:
        return "the world is dark: rays that leave the scene find no light"
    if not facts.environment_image:
        return "the world has one colour: scattered rays find it, it isn't sampled as a light"
    return f"the world's image '{scene.world.image}' is sampled where it is bright"


def _count(n: int, word: str) -> str:
    return f"{n:,} {word}{'' if n == 1 else 's'}"
