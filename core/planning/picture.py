"""What the picture of a scene needs, in words: the rules by which the native engine skips the rest."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..scene.light import AreaLight, PointLight, SpotLight, SunLight
from ..scene.material import Material
from ..scene.names import listed
from ..scene.scene import Scene
from ..tables.materials import EMISSION, GLOSSY, LAMBERTIAN, NORMAL_MAP, REFRACTION, TRANSPARENCY, flags

_KINDS = {AreaLight: "area light", PointLight: "point light", SpotLight: "spot", SunLight: "sun"}


def picture_plan(scene: Scene, max_depth: int) -> tuple[str, ...]:
    """Sentences on rays, shaders, textures, lights and environment of a validated scene."""
    used = _used(scene)
    return (*_rays(scene, used, max_depth), *_shaders(scene, used), *_textures(scene), *_lights(scene),
            *_environment(scene))


def _used(scene: Scene) -> list[Material]:
    names = dict.fromkeys(name for mesh in scene.meshes.values() for name in mesh.materials)
    names |= dict.fromkeys(one.material for one in scene.fields.values())
    return [closure for name in names for closure in scene.closures(name)]


def _rays(scene: Scene, used: list[Material], max_depth: int) -> Iterator[str]:
    faces = sum(len(m.faces) for m in scene.meshes.values())
    copies = sum(len(m.instances) for m in scene.meshes.values() if m.instances is not None)
    yield f"{_count(faces, 'triangle')}" + (f", {_count(copies, 'instance')} of them traced in place" if copies else "")
    if scene.fields:
        cells = sum(int(one.cells.prod()) for one in scene.fields.values())
        yield f"{_count(len(scene.fields), 'distance field')} of {_count(cells, 'cell')}"
    if max_depth == 1:
        yield "one segment: only light seen directly, no surface is shaded"
    elif all(flags(closure) & LAMBERTIAN for closure in used):
        yield f"up to {max_depth} segments; the last is traced only where it can see the environment"
    else:
        yield f"up to {max_depth} segments"
    if any(flags(closure) & TRANSPARENCY for closure in used):
        yield "shadow rays multiply what surfaces let through"
    else:
        yield "no surface is transparent: shadow rays stop at the first hit"


def _shaders(scene: Scene, used: list[Material]) -> Iterator[str]:
    if not used:
        return
    occurs = 0
    for closure in used:
        occurs |= flags(closure)
    if all(flags(closure) & LAMBERTIAN for closure in used):
        yield "all surfaces are Lambertian: no microfacets, no light that only a mirror finds"
    else:
        parts = [word for bit, word in ((GLOSSY, "reflection"), (REFRACTION, "refraction")) if occurs & bit]
        kinds = sorted({closure.kind.capitalize() for closure in used})
        yield f"shaders {', '.join(kinds)}" + (f", with {' and '.join(parts)}" if parts else "")
    smooth = scene.fields or any(mesh.smoothing is not None for mesh in scene.meshes.values())
    if not smooth and not occurs & NORMAL_MAP:
        yield "all is shaded flat: no normals are interpolated"


def _textures(scene: Scene) -> Iterator[str]:
    count = sum(len(material.textures) for material in scene.materials.values())
    yield f"{_count(count, 'textured value')}, from {_count(len(scene.images), 'image')}" if count else "no textures"


def _lights(scene: Scene) -> Iterator[str]:
    dark = [name for name, light in scene.lights.items() if not _shines(light)]
    shining = [light for light in scene.lights.values() if _shines(light)]
    emitting = 0
    glowing = {name for name in scene.materials if any(flags(closure) & EMISSION for closure in scene.closures(name))}
    for mesh in map(scene.meshes.__getitem__, scene.meshes_with(glowing)):
        glows = np.array([name in glowing for name in mesh.materials])
        emitting += len(mesh.faces) if mesh.face_material is None else int(np.count_nonzero(glows[mesh.face_material]))
    found = [_count(n, word) for kind, word in _KINDS.items() if (n := sum(isinstance(s, kind) for s in shining))]
    if emitting:
        found.append(_count(emitting, "emissive triangle"))
    yield f"light is sampled from {', '.join(found)}" if found else "no light is sampled: there is none but the world's"
    if dark:
        yield f"without power, left out: {listed(dark)}"


def _shines(light: object) -> bool:
    strength = getattr(light, "strength", getattr(light, "power", 0.0))
    return bool(strength > 0.0 and np.any(light.color > 0.0))  # type: ignore[attr-defined]


def _environment(scene: Scene) -> Iterator[str]:
    world = scene.world
    if not np.any(world.color * world.strength > 0.0):
        yield "the world is dark: rays that leave the scene bring nothing"
    elif world.image is None:
        yield "the world has one colour: scattered rays find it, it isn't sampled as a light"
    else:
        yield f"the world's image '{world.image}' is sampled where it is bright"


def _count(n: int, word: str) -> str:
    return f"{n:,} {word}{'' if n == 1 else 's'}"
