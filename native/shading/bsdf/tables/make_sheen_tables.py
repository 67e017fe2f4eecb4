"""Writes sheen_tables.inc: the coefficients of Blender's sheen, measured on Cycles' renders.

    python native/shading/bsdf/tables/make_sheen_tables.py     (needs bpy)

Cycles reads a, b and the albedo R of Zeltner et al. 2022 from tables of the view's cosine and the roughness, 32
places each in [0, 1], and interpolates them linearly. Here one pixel sees a small square for each pair of places
under suns without size. With the directions w = (x, y, z) in the square's frame,

    f cos = R z / pi (a / |(a x + b z, a y, z)|²)²,  so that
    sqrt(z / (pi f cos)) = c1 (x² + y²) + c2 x z + c3 z²,
    c1 = a / s, c2 = 2 b / s, c3 = (b² + 1) / (a s), s = sqrt(R):

three coefficients by least squares over the suns, and 1/R = c1 c3 - c2²/4.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import bpy
import mathutils
import numpy as np
from numpy.typing import NDArray

from edgegrad.images import read_image

Array = NDArray[np.float64]

SIZE = 32
GAP = 3  # pixels between squares, so that none shades another
# The first place is not seen, or below Cycles' least roughness: it follows from one near it and the second.
FIRST_COSINE, FIRST_ROUGHNESS = 0.8 / (SIZE - 1), 1e-3


def places(first: float) -> Array:
    return np.maximum(np.arange(SIZE) / (SIZE - 1), first)


def suns() -> Array:
    """Directions above all squares."""
    azimuth, height = np.meshgrid(np.radians([-60, -25, 15, 55]), np.radians([32, 50, 68]))
    return np.stack([np.cos(height) * np.cos(azimuth), np.cos(height) * np.sin(azimuth), np.sin(height)], -1).reshape(
        -1, 3)


def square(name: str, center: tuple[float, float], cosine: float, material: Any) -> None:
    """Turned about the y axis so that the viewer above sees it at the cosine."""
    sine, half = np.sqrt(1 - cosine**2), 0.012 / cosine
    across = np.array([cosine, 0, -sine]) * half
    along = np.array([0, 0.3, 0])
    mesh = bpy.data.meshes.new(name)
    at = np.array([*center, 0])
    mesh.from_pydata([at - across - along, at + across - along, at + across + along, at - across + along], [],
                     [(0, 1, 2, 3)])
    mesh.materials.append(material)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new(name, mesh))


def build() -> Any:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", 1
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = scene.cycles.use_light_tree = False
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 0.01
    scene.cycles.max_bounces = 0
    scene.cycles.light_sampling_threshold = 0.0
    scene.render.resolution_x, scene.render.resolution_y = SIZE * GAP, SIZE
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", float(SIZE * GAP)
    camera.location = (0, 0, 50)
    scene.collection.objects.link(camera)
    scene.camera = camera
    for row, roughness in enumerate(places(FIRST_ROUGHNESS)):
        material = bpy.data.materials.new(f"sheen {row}")
        tree = material.node_tree
        tree.nodes.clear()
        node, output = tree.nodes.new("ShaderNodeBsdfSheen"), tree.nodes.new("ShaderNodeOutputMaterial")
        node.inputs["Color"].default_value, node.inputs["Roughness"].default_value = (1, 1, 1, 1), roughness
        tree.links.new(node.outputs[0], output.inputs["Surface"])
        for column, cosine in enumerate(places(FIRST_COSINE)):
            center = (column * GAP + GAP // 2 + 0.5 - SIZE * GAP / 2, SIZE / 2 - 0.5 - row)
            square(f"{row} {column}", center, cosine, material)
    light = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    light.data.energy, light.data.angle = 1.0, 0.0
    scene.collection.objects.link(light)
    return scene


def render(scene: Any, direction: Array) -> Array:
    """(roughness, cosine) f cos; the sun's energy is 1."""
    bpy.data.objects["sun"].rotation_euler = mathutils.Vector(direction).to_track_quat("Z", "Y").to_euler()
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "sheen.exr")
        bpy.ops.render.render(write_still=True)
        return np.asarray(read_image(scene.render.filepath), float)[:, GAP // 2 :: GAP, 0]


def measure() -> tuple[Array, Array, Array]:
    """a, b and R, each (roughness, cosine)."""
    scene, cosine = build(), places(FIRST_COSINE)
    directions = suns()
    values = np.stack([render(scene, d) for d in directions])
    # The frames: the normal (sine, 0, cosine), and the view (0, 0, 1) along the surface.
    sine = np.sqrt(1 - cosine**2)
    x = directions[:, :1] * -cosine + directions[:, 2:] * sine
    y, z = directions[:, 1:2] + 0 * x, directions[:, :1] * sine + directions[:, 2:] * cosine
    basis = np.stack([x**2 + y**2, x * z, z**2], -1)  # (suns, cosine, 3)
    a, b, albedo = (np.zeros((SIZE, SIZE)) for _ in range(3))
    for row in range(SIZE):
        for column in range(SIZE):
            f = values[:, row, column]
            if not f.all():
                continue
            target = np.sqrt(z[:, column] / (np.pi * f))
            # Relative residuals: all suns count alike.
            c1, c2, c3 = np.linalg.lstsq(basis[:, column] / target[:, None], np.ones(len(f)), rcond=None)[0]
            inverse = c1 * c3 - c2**2 / 4
            a[row, column], b[row, column], albedo[row, column] = (
                c1 / np.sqrt(inverse), c2 / (2 * np.sqrt(inverse)), 1 / inverse)
    # Cycles' albedos end at 5 digits. Where they are 0, a and b are those of the next roughness.
    for row in reversed(range(SIZE - 1)):
        nothing = albedo[row] == 0
        a[row, nothing], b[row, nothing] = a[row + 1, nothing], b[row + 1, nothing]
    return a, b, albedo


def extrapolate(table: Array, first: float) -> Array:
    """The first row from the one measured at `first` places * (SIZE - 1) and the second."""
    share = first * (SIZE - 1)
    table = table.copy()
    table[0] = (table[0] - share * table[1]) / (1 - share)
    return table


def main() -> None:
    out = ["// Written by make_sheen_tables.py.\n"]
    for name, table in zip(("kSheenA", "kSheenB", "kSheenAlbedo"), measure(), strict=True):
        full = extrapolate(extrapolate(table, FIRST_ROUGHNESS).T, FIRST_COSINE).T
        if name == "kSheenAlbedo":
            full = np.maximum(full, 0)
        numbers = [f"{v:.6f}f" for v in full.ravel()]
        rows = ["    " + ", ".join(numbers[k : k + 10]) + ",\n" for k in range(0, len(numbers), 10)]
        out += [f"extern const float {name}[{full.size}] = {{\n", *rows, "};\n"]
    Path(__file__).with_name("sheen_tables.inc").write_text("".join(out))


if __name__ == "__main__":
    main()
