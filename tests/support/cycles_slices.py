"""What Cycles scatters from one direction into many: a plane under a sun without size, seen in perspective.

Each pixel is one value of f |cos|, without noise: there is one light, and its sample adds up all closures.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from edgegrad.images import read_image
from edgegrad.scene.material import SHAPED, Material

SIZE = 40
# Camera above the plane z = 0; its rays meet it at cosines from about 0.03 to 0.95.
_POSITION = np.array([0.3, -2.0, 1.1])
_PITCH = np.radians(52.0)  # from looking straight down


@dataclass
class Slice:
    wo: NDArray[np.float32]  # (n, 3) towards the camera
    wi: NDArray[np.float32]  # (3,) towards the sun
    value: NDArray[np.float32]  # (n, 3) f |cos|


_SOCKETS = {
    "PRINCIPLED": {
        "base_color": "Base Color", "metallic": "Metallic", "roughness": "Roughness",
        "diffuse_roughness": "Diffuse Roughness", "specular_ior_level": "Specular IOR Level",
        "specular_tint": "Specular Tint", "ior": "IOR", "anisotropy": "Anisotropic",
        "anisotropy_rotation": "Anisotropic Rotation", "transmission": "Transmission Weight",
        "coat_weight": "Coat Weight", "coat_roughness": "Coat Roughness", "coat_ior": "Coat IOR",
        "coat_tint": "Coat Tint", "sheen_weight": "Sheen Weight", "sheen_roughness": "Sheen Roughness",
        "sheen_tint": "Sheen Tint", "thin_film_thickness": "Thin Film Thickness", "thin_film_ior": "Thin Film IOR",
    },
    "DIFFUSE": {"base_color": "Color", "diffuse_roughness": "Roughness"},
    "GLOSSY": {"base_color": "Color", "roughness": "Roughness", "anisotropy": "Anisotropy",
               "anisotropy_rotation": "Rotation"},
    "GLASS": {"base_color": "Color", "roughness": "Roughness", "ior": "IOR",
              "thin_film_thickness": "Thin Film Thickness", "thin_film_ior": "Thin Film IOR"},
    "REFRACTION": {"base_color": "Color", "roughness": "Roughness", "ior": "IOR"},
    "TRANSLUCENT": {"base_color": "Color"},
    "SHEEN": {"base_color": "Color", "roughness": "Roughness"},
    "VELVET": {"base_color": "Color", "roughness": "Roughness"},
}  # fmt: skip
_NODES = {
    "PRINCIPLED": "ShaderNodeBsdfPrincipled", "DIFFUSE": "ShaderNodeBsdfDiffuse", "GLOSSY": "ShaderNodeBsdfAnisotropic",
    "GLASS": "ShaderNodeBsdfGlass", "REFRACTION": "ShaderNodeBsdfRefraction",
    "TRANSLUCENT": "ShaderNodeBsdfTranslucent", "SHEEN": "ShaderNodeBsdfSheen",
    "VELVET": "ShaderNodeBsdfSheen",
}  # fmt: skip


def _shader(tree: Any, m: Material) -> None:
    tree.nodes.clear()
    node = tree.nodes.new(_NODES[m.kind])
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    if m.kind in SHAPED:
        many = m.multiscatter and m.kind != "REFRACTION" and m.distribution == "GGX"
        node.distribution = "MULTI_GGX" if many else m.distribution
    if m.kind in ("SHEEN", "VELVET"):
        node.distribution = "MICROFIBER" if m.kind == "SHEEN" else "ASHIKHMIN"
    for field, socket in _SOCKETS[m.kind].items():
        value = getattr(m, field)
        node.inputs[socket].default_value = (*value, 1.0) if np.ndim(value) else float(value)
    if m.anisotropy:
        tangent = tree.nodes.new("ShaderNodeTangent")
        tangent.direction_type, tangent.axis = "RADIAL", "Z"
        tree.links.new(tangent.outputs[0], node.inputs["Tangent"])


def _scene() -> Any:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = 1
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = scene.cycles.use_light_tree = False
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 0.01
    scene.cycles.max_bounces = 0
    scene.cycles.light_sampling_threshold = scene.cycles.sample_clamp_direct = 0.0
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.view_settings.view_transform = "Raw"
    scene.world = bpy.data.worlds.new("dark")
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.0
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.angle = np.radians(60.0)
    camera.location, camera.rotation_euler = _POSITION, (_PITCH, 0.0, 0.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    return scene


def pixels() -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """(n, 3) directions to the camera of all pixels, row by row from the top, and (n, 3) points of the plane."""
    at = ((np.arange(SIZE) + 0.5) / SIZE * 2 - 1) * np.tan(np.radians(30.0))
    x, y = np.meshgrid(at, -at)
    right, up, back = np.eye(3)[0], *np.array(
        [[0, np.cos(_PITCH), np.sin(_PITCH)], [0, -np.sin(_PITCH), np.cos(_PITCH)]])
    d = x[..., None] * right + y[..., None] * up - back
    d = d.reshape(-1, 3) / np.linalg.norm(d.reshape(-1, 3), axis=1, keepdims=True)
    return (-d).astype(np.float32), _POSITION - d * (_POSITION[2] / d[:, 2:])


def cycles_slice(material: Material, wi: NDArray[np.float64], inside: bool = False) -> Slice:
    """Renders the plane with the sun in the direction wi; inside: the camera sees the plane's back."""
    scene = _scene()
    mesh = bpy.data.meshes.new("plane")
    corners = [(-99.0, -99.0, 0.0), (99.0, -99.0, 0.0), (99.0, 99.0, 0.0), (-99.0, 99.0, 0.0)]
    mesh.from_pydata(corners, [], [(3, 2, 1, 0) if inside else (0, 1, 2, 3)])
    plane = bpy.data.objects.new("plane", mesh)
    shader = bpy.data.materials.new("shader")
    _shader(shader.node_tree, material)
    mesh.materials.append(shader)
    scene.collection.objects.link(plane)
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy, sun.data.angle = 1.0, 0.0
    import mathutils

    sun.rotation_euler = mathutils.Vector(wi).to_track_quat("Z", "Y").to_euler()
    scene.collection.objects.link(sun)
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "slice.exr")
        bpy.ops.render.render(write_still=True)
        image = read_image(scene.render.filepath)
    return Slice(pixels()[0], np.asarray(wi, np.float32), np.asarray(image, np.float32)[..., :3].reshape(-1, 3))
