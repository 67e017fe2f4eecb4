"""The mean of what the nodes of lights emit, where it varies with position or direction (textures, IES, falloff).

Edgegrad's lights emit the same everywhere and in all directions. Cycles renders a copy of the light in a scene of its
own: an area light is seen from the front, other lights light the inside of a sphere. Their mean replaces the nodes, or
a point light that shines differently in different directions becomes a small body that glows (`directed_lamps`).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import bmesh
import bpy
import numpy as np
from numpy.typing import NDArray

from edgegrad.scene.placement import places

from ..bakes.bake import Temporary, temporary
from ..bakes.bake_scene import BakeScene, own_groups, show_to
from ..bakes.trees import Trees, insert
from ..exported import Export
from ..nodes.ray_kinds import SAMPLED
from .directed_lamps import may_be_directed, replace_light
from .lamp_nodes import LampEmission, own_color

PIXELS = 64
UNIFORM = 0.05  # spread of a light that counts as the same in all directions, relative to its maximum
DIRECTIONS = 1024  # pixels around the panorama of a light that shines differently in different directions
ALBEDO = 0.8  # of the sphere, which is lit directly only


def bake_lamps(out: Export, emissions: Mapping[str, LampEmission], resolution: int) -> None:
    """Replace nodes of lights that vary by their mean, unless nothing is to be baked; report both.

    Parameters
    ----------
    emissions
        What the nodes of each exported light say, by its name in the scene.
    """
    for name, source in list(out.lights.items()):
        ob = bpy.data.objects.get(source.object)
        if ob is None or ob.type != "LIGHT":
            continue
        light, where = ob.data, f"light '{ob.name}'"
        emission = emissions[name]
        for note in emission.notes:
            out.report.warn(where, note)
        if not emission.varying:
            continue
        color = own_color(light)
        reach = _reach(out, source.matrix[:3, 3])
        directed = directions(light, emission, reach) if resolution > 0 and may_be_directed(out, name, light) else None
        if directed is not None:
            replace_light(out, name, color, directed, reach)
            out.report.tell(where, "shines differently in different directions, so it is a small body that glows")
            continue
        mean = mean_emission(light, emission, reach) if resolution > 0 else None
        why = "; ".join(dict.fromkeys(emission.varying))
        if mean is None:
            out.report.warn(where, f"its nodes are left out, since {why}")
            continue
        out.scene.lights[name].color = np.maximum(color * mean, 0.0)
        out.report.warn(where, f"it emits the mean of its nodes, since {why}")


def _reach(out: Export, position: NDArray[np.float64]) -> float:
    """Typical distance of the surfaces that a light illuminates, for light that does not fall with its square."""
    distances = []
    for mesh in out.scene.meshes.values():
        if mesh.is_single and len(mesh.vertices):
            place = places(mesh)[0]
            points = mesh.vertices @ place[:, :3].T + place[:, 3]
            nearest = np.clip(position, points.min(axis=0), points.max(axis=0))
            distances.append(float(np.linalg.norm(position - nearest)))
    away = [distance for distance in distances if distance > 0.0]
    return float(np.median(away)) if away else 1.0


def mean_emission(light: Any, emission: LampEmission, reach: float) -> NDArray[np.float64] | None:
    """(3,) mean factor of the power that the nodes of a light apply at a distance; None if Cycles can't tell."""
    if light.type == "SUN":
        return None
    try:
        with temporary() as keep:
            return _area(keep, light, emission) if light.type == "AREA" else _point(keep, light, emission, reach)
    except RuntimeError:
        return None


def directions(light: Any, emission: LampEmission, reach: float) -> NDArray[np.float64] | None:
    """(H, W, 3) factor of the power of a point or spot light by direction; None: it does not vary, or Cycles fails."""
    try:
        with temporary() as keep:
            everywhere = lit_sphere(keep, light, emission, reach, PIXELS)
            shone = everywhere[_shines(light, len(everywhere))]
            if np.ptp(shone, axis=(0, 1)).max() <= UNIFORM * shone.max():
                return None
            return lit_sphere(keep, light, emission, reach, DIRECTIONS, cone=True)
    except RuntimeError:
        return None


def _shines(light: Any, height: int) -> NDArray[np.bool_]:
    """(height,) rows of a panorama in the axes of a light to which it shines: a spot shines along its -Z."""
    from_axis = np.pi * (1.0 - (np.arange(height) + 0.5) / height)
    reach = 0.5 * light.spot_size if light.type == "SPOT" else np.pi
    return np.asarray(from_axis <= max(reach, from_axis.min()))


def _copy(keep: Temporary, light: Any, emission: LampEmission, **settings: Any) -> Any:
    """Copy a light with white light of 1 W, whose nodes are evaluated as where Cycles samples lights."""
    made = keep(light.copy())
    own_groups(made.node_tree, keep)
    show_to(made.node_tree, SAMPLED)
    insert(emission.constants, Trees(made, keep))
    made.energy, made.color = 1.0, (1.0, 1.0, 1.0)
    for name, value in ({"exposure": 0.0, "use_temperature": False, "normalize": True} | settings).items():
        if hasattr(made, name):
            setattr(made, name, value)
    return made


def _area(keep: Temporary, light: Any, emission: LampEmission) -> NDArray[np.float64]:
    small = BakeScene(keep, f"light '{light.name}'")
    made = _copy(keep, light, emission, spread=np.pi)
    ob = keep(bpy.data.objects.new("Edgegrad bake", made))
    ob.visible_camera = True
    small.scene.collection.objects.link(ob)
    # The light shines along its -Z, towards the camera.
    small.camera.location, small.camera.rotation_euler = (0.0, 0.0, -1.0), (np.pi, 0.0, 0.0)
    width = max(light.size, light.size_y if light.shape in ("RECTANGLE", "ELLIPSE") else 0.0)
    small.lens.type, small.lens.ortho_scale = "ORTHO", 1.05 * width
    radiance = small.picture(PIXELS, PIXELS).astype(np.float64)
    # A Lambertian emitter of radiance L emits the power pi L per area.
    return np.asarray(np.pi * radiance.mean(axis=(0, 1)) * (1.05 * width) ** 2)


def _point(keep: Temporary, light: Any, emission: LampEmission, reach: float) -> NDArray[np.float64]:
    """Measure the mean intensity of a point light in all directions, or of a spot in its cone."""
    picture = lit_sphere(keep, light, emission, reach, PIXELS)
    rows = np.sin(np.pi * (np.arange(len(picture)) + 0.5) / len(picture)) * _shines(light, len(picture))
    return np.asarray(np.average(picture.mean(axis=1), axis=0, weights=rows))


def lit_sphere(keep: Temporary, light: Any, emission: LampEmission, reach: float, pixels: int,
               cone: bool = False) -> NDArray[np.float64]:  # fmt: skip
    """(pixels / 2, pixels, 3) factor of the power of a light in all directions, as a panorama in its own axes.

    Parameters
    ----------
    reach
        Distance at which it is measured.
    cone
        Whether a spot keeps its cone; otherwise it shines in all directions.
    """
    small = BakeScene(keep, f"light '{light.name}'")
    made = _copy(keep, light, emission, shadow_soft_size=0.0)
    if made.type == "SPOT" and not cone:
        made.type = "POINT"
    ob = keep(bpy.data.objects.new("Edgegrad bake", made))
    small.scene.collection.objects.link(ob)
    white = keep(bpy.data.materials.new("Edgegrad bake"))
    if white.node_tree is None:
        white.use_nodes = True
    tree = white.node_tree
    tree.nodes.clear()
    diffuse, output = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeOutputMaterial")
    diffuse.inputs["Color"].default_value = (ALBEDO, ALBEDO, ALBEDO, 1.0)
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    mesh = keep(bpy.data.meshes.new("Edgegrad bake"))
    body = bmesh.new()
    bmesh.ops.create_icosphere(body, subdivisions=5, radius=reach)
    body.to_mesh(mesh)
    body.free()
    mesh.materials.append(white)
    small.scene.collection.objects.link(keep(bpy.data.objects.new("Edgegrad bake", mesh)))
    small.scene.cycles.max_bounces = 0
    radiance = small.panorama(pixels).astype(np.float64)
    # The irradiance at the sphere is P / (4 pi reach^2); its radiance is albedo / pi times that.
    return np.asarray(radiance * np.pi / ALBEDO * 4.0 * np.pi * reach**2)
