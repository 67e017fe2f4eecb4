"""Whole scenes over the whole public interface, each a pure function of its seed."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from edgegrad import AreaLight, Bounces, PointLight, Scene, SpotLight
from edgegrad.scene import parameters
from tests.support.table_values import WITHOUT
from tests.torture.drawing import additions, cameras, lights, materials, media, meshes, textures
from tests.torture.drawing.draw import Draw

# Share of the scenes that have distance fields.
FIELDS = 0.35


@dataclass
class Case:
    """A scene, what its derivative is taken with respect to, and how it is rendered.

    Attributes
    ----------
    scene
        What to render.
    wrt
        Parameter paths.
    options
        Of `Renderer.render` and of derivatives.
    scale
        About the size of what is in it, metres; 1 for half of the scenes.
    kinds
        Words that say what is in the scene, for tables of results.
    """

    scene: Scene
    wrt: tuple[str, ...]
    options: dict[str, Any]
    scale: float
    kinds: tuple[str, ...] = field(default=())


def case(seed: int) -> Case:
    """The scene of a seed."""
    draw = Draw(seed)
    # The world's size in metres; every other one is of ordinary size, where nothing but the scene itself is hard.
    scale = draw.scale = 1.0 if draw.chance(0.5) else 10.0 ** draw.uniform(-6.0, 7.0)
    shaders = materials.materials(draw)
    count = 0 if draw.chance(0.02) else draw.whole(1, 4)
    bodies = {f"mesh.{k}": meshes.mesh(draw, tuple(shaders), scale) for k in range(count)}
    lamps = {f"lamp{k}": lights.light(draw, scale, tuple(bodies)) for k in range(draw.whole(0, 3))}
    has_image = draw.chance(0.35)
    pictures = textures.images(draw) | ({"sky": textures.sky(draw)} if has_image else {})
    scene = Scene(cameras.camera(draw, scale), bodies, shaders, lamps, cameras.world(draw, has_image), pictures)
    shift = scale * draw.one((1e2, 1e4)) * draw.rng.normal(size=3) if draw.chance(0.1) else np.zeros(3)
    _shift(scene, shift)
    _light_up(scene)
    options: dict[str, Any] = {"spp": draw.whole(1, 4), "max_depth": draw.whole(1, 8), "seed": draw.whole(0, 2**32 - 1)}
    if draw.chance(0.2):
        options["bounces"] = Bounces(*(draw.one((0, 1, 2, 255)) for _ in range(4)))
    asked = _asked(draw, scene)
    # What follows is drawn from numbers of its own: a seed keeps its scene but for what is added.
    before, more = paths_of(scene), Draw((seed, 1))
    additions.add_values(more, scene, scale)
    if more.chance(FIELDS):
        additions.add_fields(more, scene, scale, shift)
    additions.turn_lights_negative(Draw((seed, 2)), scene)
    bounds = Draw((seed, 3))
    if bounds.chance(0.3):
        filtered = bounds.one((0.05, 0.3, 1.0, 10.0, 1e30))
        options["bounces"] = replace(options.get("bounces", Bounces()), filter_glossy=filtered)
    media.add_media(Draw((seed, 4)), scene, scale)
    paths = paths_of(scene)
    new = [path for path in paths if path not in before]
    all_asked = len(asked) == len(before)
    # An addition may replace an expression, and the new one may have no numbers.
    asked = tuple(path for path in asked if path in paths)
    if all_asked or not asked:
        asked = tuple(paths)
    elif new and more.chance(0.7):
        asked = tuple(dict.fromkeys([*asked, *(more.one(new) for _ in range(more.whole(1, 3)))]))
    return Case(scene, asked, options, scale, kinds_of(scene, scale))


def paths_of(scene: Scene) -> list[str]:
    """Every parameter that has a derivative."""
    paths = [path for path in parameters.paths(scene) if not path.endswith(WITHOUT)]
    return [path for path in paths if not _of_empty_medium(scene, path)]


def _of_empty_medium(scene: Scene, path: str) -> bool:
    """Whether the parameter is a coefficient of a medium whose coefficients are all 0, where there is no derivative."""
    held, field = parameters.owner(scene, path)
    medium = held.medium if field.startswith(parameters.MEDIUM) else None
    return medium is not None and not any(medium.scattering) and not any(medium.absorption)


def kinds_of(scene: Scene, scale: float) -> tuple[str, ...]:
    """Describe the contents of a scene."""
    leaves = [leaf for name in scene.used_materials for leaf in scene.closures(name)]
    found = {f"material {leaf.kind}" for leaf in leaves}
    found |= {f"light {type(lamp).__name__}" for lamp in scene.lights.values()}
    found |= {f"camera {scene.camera.kind}", f"world of {'an image' if scene.world.image else 'one colour'}"}
    found.add("size of 1 m" if scale == 1.0 else f"size of 1e{int(np.floor(np.log10(scale) / 4.0)) * 4} m and more")
    said = {
        "textures": any(leaf.textures for leaf in leaves),
        "mixture": "mix" in scene.used_materials,
        "instances": any(mesh.instances is not None for mesh in scene.meshes.values()),
        "smooth": any(mesh.smoothing is not None for mesh in scene.meshes.values()),
        "no meshes": not scene.meshes,
        "fields": bool(scene.fields),
        "light falloff": any(getattr(lamp, "decay", "QUADRATIC") != "QUADRATIC" for lamp in scene.lights.values()),
        "negative light": additions.any_negative(scene),
        "medium": any(leaf.medium for leaf in leaves) or scene.world.medium is not None,
        "values of instances": any(mesh.instance_attributes for mesh in scene.meshes.values()),
        "normals in world space": any(leaf.normal_space == "WORLD" for leaf in leaves),
        "linking": any(lamp.receivers is not None or lamp.blockers is not None for lamp in scene.lights.values()),
        "depth of field": scene.camera.aperture_radius > 0.0,
    }  # fmt: skip
    return tuple(sorted(found | {word for word, holds in said.items() if holds}))


def _light_up(scene: Scene) -> None:
    """Give a dark scene, which is refused, a light world."""
    try:
        scene.validate()
    except ValueError as error:
        if "nothing emits light" not in str(error):
            raise
        scene.world.color, scene.world.strength = np.full(3, 0.5), 1.0


def _shift(scene: Scene, by: np.ndarray) -> None:
    """Put the scene elsewhere."""
    for mesh in scene.meshes.values():
        mesh.transform = mesh.transform.copy()
        mesh.transform[:3, 3] += by
    for lamp in scene.lights.values():
        if isinstance(lamp, AreaLight):
            lamp.to_world[:3, 3] += by
        elif isinstance(lamp, (PointLight, SpotLight)):
            lamp.position = lamp.position + by
    scene.camera.to_world[:3, 3] += by


def _asked(draw: Draw, scene: Scene) -> tuple[str, ...]:
    """One parameter, a few, or all of them."""
    paths = paths_of(scene)
    kind = draw.whole(0, 5)
    if kind == 0:
        return tuple(paths)
    count = 1 if kind < 3 else draw.whole(2, 5)
    # Scenes have many fields of materials that nothing reads: collections come first, so that each has its turn.
    found = []
    for _ in range(count):
        groups = sorted({path.split(".")[0] for path in paths})
        group = draw.one(groups)
        found.append(draw.one([path for path in paths if path.startswith(f"{group}.")]))
    return tuple(dict.fromkeys(found))
