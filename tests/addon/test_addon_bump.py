"""Export of bump, normals, displacement and missing images, and of what is baked on small and borrowed meshes."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from edgegrad import expression as e
from edgegrad.expression import nodes_of
from edgegrad_addon.export.bakes import image_cache
from edgegrad_addon.export.bakes.bake import ObjectBaker
from edgegrad_addon.export.bakes.unwrap import THIN, islands, widened
from edgegrad_addon.export.geometry import attributes
from tests.support.scenes import blender_scenes as bs


@pytest.fixture(autouse=True)
def _scene() -> Iterator[None]:
    bs.empty()
    bs.camera((0.0, 0.0, 8.0))
    yield


def material(name: str = "M") -> Any:
    return bs.material(name, (0.5, 0.5, 0.5), "ShaderNodeBsdfPrincipled")


def node(tree: Any, kind: str, **settings: Any) -> Any:
    made = tree.nodes.new("ShaderNode" + kind)
    for key, value in settings.items():
        setattr(made, key, value)
    return made


def noisy_bump(tree: Any) -> Any:
    bump, noise = node(tree, "Bump"), node(tree, "TexNoise")
    tree.links.new(noise.outputs[0], bump.inputs["Height"])
    return bump


def test_bump_is_an_expression_and_nothing_is_baked() -> None:
    made = material()
    bump = noisy_bump(made.node_tree)
    bump.inputs["Distance"].default_value, bump.invert = 0.3, True
    made.node_tree.links.new(bump.outputs[0], bs.shader(made).inputs["Normal"])
    bs.add("Cube", bs.cube("Cube", made))
    export = bs.export(bake=16)
    m = export.scene.materials["M"]
    normal = m.textures["normal"]
    assert m.normal_space == "WORLD" and isinstance(normal, e.Bump)
    assert normal.distance == pytest.approx(0.3) and normal.invert
    assert attributes.GENERATED in export.scene.meshes["Cube"].attributes
    assert not export.scene.images and not export.report.lines


def test_steps_are_tenths_of_pixels() -> None:
    """Of a perspective camera's pixels: their size times the distance in the middle of the picture."""
    from tests.support.node_cases.texture_points import corners_mesh, evaluate, points, scene_of

    made = material()
    made.node_tree.links.new(noisy_bump(made.node_tree).outputs[0], bs.shader(made).inputs["Normal"])
    bs.add("Cube", bs.cube("Cube", made))
    scene = bs.export().scene
    step = scene.materials["M"].textures["normal"].step
    where = points(2, position=np.array([[0.0, 0.0, 1.0], [0.5, 0.2, 2.0]]))
    found = evaluate(scene_of([step], {"mesh": corners_mesh(P=np.zeros((1, 3)))}), where)[0, :, 0]
    assert found[0] == pytest.approx(0.1 * 7.0 / scene.camera.focal, rel=1e-4)
    x, y, z = np.array([0.5, 0.2, 6.0]) / np.linalg.norm([0.5, 0.2, 6.0])
    share = 0.5 * (np.sqrt(1.0 - x * x) + np.sqrt(1.0 - y * y)) * z
    assert found[1] == pytest.approx(0.1 * share * np.linalg.norm([0.5, 0.2, 6.0]) / scene.camera.focal, rel=1e-4)


def test_normals_are_read_wherever_they_are_used() -> None:
    made = material()
    tree = made.node_tree
    weight, mapped = node(tree, "LayerWeight"), node(tree, "NormalMap")
    image = node(tree, "TexImage", image=bpy.data.images.new("Normals", 4, 4, is_data=True))
    tree.links.new(image.outputs["Color"], mapped.inputs["Color"])
    bump = noisy_bump(tree)
    tree.links.new(mapped.outputs[0], bump.inputs["Normal"])
    tree.links.new(bump.outputs[0], weight.inputs["Normal"])
    tree.links.new(weight.outputs["Facing"], bs.shader(made).inputs["Roughness"])
    cube = bs.add("Cube", bs.cube("Cube", made))
    cube.data.uv_layers.new(name="UVMap")
    export = bs.export(bake=16)
    kinds = {type(one) for one in nodes_of(export.scene.materials["M"].textures["roughness"])}
    assert {e.LayerWeight, e.Bump, e.NormalMap} <= kinds
    assert f"{attributes.ACTIVE_UV}.tangent" in export.scene.meshes["Cube"].attributes
    assert not export.report.lines


@pytest.mark.parametrize("method", ["BUMP", "BOTH"])
def test_displacement_is_bump(method: str) -> None:
    made = material()
    tree = made.node_tree
    moved, noise = node(tree, "Displacement"), node(tree, "TexNoise")
    tree.links.new(noise.outputs[0], moved.inputs["Height"])
    tree.links.new(moved.outputs[0], tree.get_output_node("CYCLES").inputs["Displacement"])
    made.displacement_method = method
    cube = bs.add("Cube", bs.cube("Cube", made))
    cube.scale = (2.0, 2.0, 2.0)
    export = bs.export(bake=16)
    m = export.scene.materials["M"]
    assert isinstance(m.textures["smooth_normal"], e.Bump if method == "BUMP" else e.DisplacedBump)
    assert "normal" not in m.textures
    assert export.scene.meshes["Cube"].attributes[attributes.SCALE] == pytest.approx(2.0)
    assert all("shaded smooth but coarse" in line for line in export.report.lines)
    assert bool(export.report.lines) == (method == "BOTH")  # then Cycles shades its flat faces smooth
    cube.scale = (2.0, 2.0, 1.0)
    uneven = [line for line in bs.export(bake=16).report.lines if "scaled unevenly" in line]
    assert bool(uneven) == (method == "BOTH")


@pytest.mark.parametrize("space", ["OBJECT", "WORLD"])
@pytest.mark.parametrize("scale", [1.0, 1.7, -1.3])
def test_normals_of_displacement_and_bump_are_those_of_cycles(space: str, scale: float, tmp_path: Path) -> None:
    made = bs.material("Glow", (1.0, 1.0, 1.0), "ShaderNodeEmission")
    made.displacement_method = "BOTH"
    tree = made.node_tree
    moved, noise, where = node(tree, "Displacement", space=space), node(tree, "TexNoise"), node(tree, "TexCoord")
    moved.inputs["Scale"].default_value, noise.inputs["Scale"].default_value = 0.5, 2.0
    noise.inputs["Detail"].default_value = 0.0
    geometry, shown = node(tree, "NewGeometry"), node(tree, "VectorMath", operation="MULTIPLY_ADD")
    shown.inputs[1].default_value = shown.inputs[2].default_value = (0.5, 0.5, 0.5)
    emission = next(one for one in tree.nodes if one.type == "EMISSION")
    emission.inputs["Strength"].default_value = 1.0
    tree.links.new(where.outputs["Object"], noise.inputs["Vector"])
    tree.links.new(noise.outputs[0], moved.inputs["Height"])
    tree.links.new(moved.outputs[0], tree.get_output_node("CYCLES").inputs["Displacement"])
    tree.links.new(geometry.outputs["Normal"], shown.inputs[0])
    tree.links.new(shown.outputs[0], emission.inputs["Color"])
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=12, y_subdivisions=12, size=6.0)
    ground = bpy.context.object
    ground.data.materials.append(made)
    ground.data.shade_smooth()
    ground.rotation_euler, ground.scale = (0.4, 0.2, 0.3), (scale,) * 3
    export = bs.export()
    ours, theirs = edgegrad.render(export.scene, spp=64, max_depth=1), bs.cycles(tmp_path)
    assert not export.report.lines
    assert ours.std() > 0.02
    assert np.abs(ours - theirs).mean() < 2.5e-3


def test_missing_images_are_magenta() -> None:
    made = material()
    gone = bpy.data.images.new("gone", 4, 4)
    gone.source, gone.filepath = "FILE", "//gone.png"
    texture = node(made.node_tree, "TexImage", image=gone)
    made.node_tree.links.new(texture.outputs["Color"], bs.shader(made).inputs["Base Color"])
    made.node_tree.links.new(texture.outputs["Alpha"], bs.shader(made).inputs["Roughness"])
    bs.add("Cube", bs.cube("Cube", made))
    export = bs.export(bake=16)
    m = export.scene.materials["M"]
    assert m.textures == {} and m.base_color == pytest.approx((1.0, 0.0, 1.0)) and m.roughness == 1.0
    assert not export.scene.images and len(export.report.lines) == 1 and "'gone'" in export.report.lines[0]


def unreadable(made: Any, socket: str = "Base Color") -> None:
    wave = node(made.node_tree, "Wavelength")
    wave.inputs[0].default_value = 600.0
    made.node_tree.links.new(wave.outputs[0], bs.shader(made).inputs[socket])


def baked_colors(export: Any, mesh: str) -> Any:
    """Baked colours at the corners of a mesh's faces of its first material, drawn to their middles."""
    scene = export.scene
    one = scene.meshes[mesh]
    name = next(name for name in one.materials if "base_color" in scene.materials[name].textures)
    picture = next(n for n in nodes_of(scene.materials[name].textures["base_color"]) if isinstance(n, e.ImageTexture))
    pixels = scene.images[picture.image].pixels
    uv = one.attributes[attributes.BAKED_UV][one.face_material == one.materials.index(name)]
    uv = (0.9 * uv + 0.1 * uv.mean(axis=1, keepdims=True)).reshape(-1, 2)
    size = len(pixels)
    return pixels[np.clip(((1.0 - uv[:, 1]) * size).astype(int), 0, size - 1), (uv[:, 0] * size).astype(int)]


def test_faces_below_a_texel_get_their_value() -> None:
    made = material()
    unreadable(made)
    rng = np.random.default_rng(1)
    centre = rng.uniform(-1.0, 1.0, (40, 1, 3))
    side = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]) * 0.002
    points = np.concatenate([(centre + side).reshape(-1, 3), 5.0 * side / 0.002])
    mesh = bpy.data.meshes.new("Cloud")
    mesh.from_pydata(points.tolist(), [], np.arange(len(points)).reshape(-1, 4).tolist())
    for one in (made, bs.material("Other", (0.2, 0.2, 0.2))):
        mesh.materials.append(one)
    mesh.polygons[40].material_index = 1
    bs.add("Cloud", mesh)
    colors = baked_colors(bs.export(bake=64), "Cloud")
    assert np.ptp(colors, axis=0).max() < 1e-4 and colors[0, 0] > 0.1


def test_thin_islands_are_widened() -> None:
    # A large square, a splinter of a tenth of a texel, and a point-like square that is not chosen.
    square = np.array([(0, 0), (0.5, 0), (0.5, 0.5), (0, 0.5)])
    splinter = np.array([(0.6, 0.6), (0.9, 0.9), (0.9, 0.9016)])
    speck = 0.9 + 1e-4 * square
    uv = np.concatenate([square, splinter, speck]).astype(np.float32)
    sizes, vertices = np.array([4, 3, 4], np.int32), np.arange(11, dtype=np.int32)
    number = islands(uv, vertices, sizes)
    assert len(set(number)) == 3 and len(set(number[:4])) == 1
    chosen = np.arange(11) < 7
    wide = widened(uv, chosen, vertices, sizes, 64)
    assert wide is not None
    assert wide[:4] == pytest.approx(uv[:4]) and wide[7:] == pytest.approx(uv[7:])
    spread = np.linalg.svd((wide[4:7] - wide[4:7].mean(axis=0)) * 64)[1]
    assert spread.min() > 0.5 * THIN
    assert widened(uv[:4], chosen[:4], vertices[:4], sizes[:1], 64) is None


def test_faces_that_share_edges_are_one_island() -> None:
    vertices = np.array([0, 1, 2, 0, 2, 3, 4, 5, 6], np.int32)
    uv = np.array([(0, 0), (1, 0), (1, 1), (0, 1), (5, 5), (6, 5), (6, 6)], np.float32)[vertices]
    number = islands(uv, vertices, np.full(3, 3, np.int32))
    assert list(number) == [0] * 6 + [2] * 3


def test_instances_of_geometry_nodes_are_baked() -> None:
    made = material()
    unreadable(made)
    group = bpy.data.node_groups.new("Instances", "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    grid, cube, copies, painted = (group.nodes.new("GeometryNode" + kind) for kind in
                                   ("MeshGrid", "MeshCube", "InstanceOnPoints", "SetMaterial"))  # fmt: skip
    grid.inputs["Vertices X"].default_value = grid.inputs["Vertices Y"].default_value = 2
    painted.inputs["Material"].default_value = made
    group.links.new(grid.outputs[0], copies.inputs["Points"])
    group.links.new(cube.outputs[0], copies.inputs["Instance"])
    group.links.new(copies.outputs[0], painted.inputs["Geometry"])
    group.links.new(painted.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    bs.add("Holder", bs.cube("Holder")).modifiers.new("Instances", "NODES").node_group = group
    export = bs.export(bake=16)
    assert not any("baked" in line for line in export.report.lines)
    (name,) = export.scene.meshes
    assert np.ptp(baked_colors(export, name), axis=0).max() < 1e-4


def test_linked_materials_are_baked(tmp_path: Path) -> None:
    made = material()
    unreadable(made)
    bpy.data.libraries.write(str(tmp_path / "library.blend"), {made})
    bs.empty()
    bs.camera((0.0, 0.0, 8.0))
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, to):
        to.materials = ["M"]
    linked = bpy.data.materials["M"]
    assert linked.library is not None
    bs.add("Cube", bs.cube("Cube", linked))
    export = bs.export(bake=16)
    assert not export.report.lines
    assert baked_colors(export, "Cube")[0, 0] > 0.1


def image_file(folder: Path, value: float) -> Path:
    """A PNG file that is older than the process."""
    made = bpy.data.images.new("made", 8, 8)
    made.pixels.foreach_set(np.tile(np.array([value, 0.5, 0.25, 1.0], np.float32), 64))
    path = folder / "color.png"
    made.filepath_raw, made.file_format = str(path), "PNG"
    made.save()
    bpy.data.images.remove(made)
    return path


def test_decoded_files_are_kept_until_something_changes(tmp_path: Path, monkeypatch: Any) -> None:
    image = bpy.data.images.load(str(image_file(tmp_path, 1.0)))
    made = material()
    texture = node(made.node_tree, "TexImage", image=image)
    made.node_tree.links.new(texture.outputs["Color"], bs.shader(made).inputs["Base Color"])
    bs.add("Cube", bs.cube("Cube", made))

    def pixels() -> Any:
        return next(iter(bs.export(bake=0).scene.images.values())).pixels

    first = pixels()
    assert pixels() is not first  # the file is younger than the process: Blender may have other pixels
    monkeypatch.setattr(image_cache, "_start", 1 << 62)
    first = pixels()
    assert pixels() is first
    image.colorspace_settings.name = "Non-Color"
    assert pixels() is not first
    image.colorspace_settings.name = "sRGB"
    assert pixels() is first
    image_file(tmp_path, 0.0)
    os.utime(tmp_path / "color.png", (1e9, 1e9))
    image.reload()
    changed = pixels()
    assert changed is not first and changed[0, 0, 0] == 0.0
    image.pixels[0] = 0.5  # painted in Blender
    assert pixels() is not changed


def test_few_pixels_are_kept(monkeypatch: Any) -> None:
    monkeypatch.setattr(image_cache, "LARGEST", 100)
    for k in range(4):
        image_cache.keep(("key", k), np.zeros((4, 4, 1), np.float32))
    assert image_cache.kept(("key", 3)) is not None and image_cache.kept(("key", 0)) is None


def test_bakes_are_kept_until_something_changes(monkeypatch: Any) -> None:
    made = material()
    unreadable(made)
    cube = bs.add("Cube", bs.cube("Cube", made))
    count = 0
    bake = ObjectBaker.bake

    def counted(*given: Any) -> Any:
        nonlocal count
        count += 1
        return bake(*given)

    monkeypatch.setattr(ObjectBaker, "bake", counted)
    wave = next(one for one in made.node_tree.nodes if one.type == "WAVELENGTH")

    def bakes() -> int:
        before = count
        bpy.context.view_layer.update()
        bs.export(bake=16)
        return count - before

    assert (bakes(), bakes()) == (1, 0)
    wave.inputs[0].default_value = 500.0
    assert (bakes(), bakes()) == (1, 0)
    cube.location.x = 1.0
    assert (bakes(), bakes()) == (1, 0)
    cube.data.vertices[0].co.x += 0.1
    cube.data.update()
    assert (bakes(), bakes()) == (1, 0)
    ramp = node(made.node_tree, "ValToRGB")
    made.node_tree.links.new(wave.outputs[0], ramp.inputs[0])
    made.node_tree.links.new(ramp.outputs[0], bs.shader(made).inputs["Base Color"])
    assert bakes() == 1  # the ramp reads what is baked
    # What is painted in Blender may change unnoticed.
    bpy.data.images.new("Painted", 4, 4)
    node(made.node_tree, "TexImage", image=bpy.data.images["Painted"])
    assert (bakes(), bakes()) == (1, 1)


def test_bakes_are_as_fine_as_the_picture() -> None:
    made = material()
    unreadable(made)
    bs.add("Cube", bs.cube("Cube", made))
    sizes = []
    for pixels, largest in ((64, 4096), (256, 4096), (256, 100)):
        bpy.context.scene.render.resolution_x = bpy.context.scene.render.resolution_y = pixels
        export = bs.export(bake=largest)
        sizes.append(len(next(iter(export.scene.images.values())).pixels))
        # A face of the cube, two metres wide, lies seven metres away.
        covered = 0.4 * sizes[-1] ** 2 / 6.0
        assert largest == 100 or covered > 2.0 * (2.0 / 7.0 * export.scene.camera.focal) ** 2
    assert sizes[1] == 4 * sizes[0] and sizes[2] == 100


@pytest.mark.parametrize("space", ["TANGENT", "OBJECT", "WORLD", "BLENDER_OBJECT", "BLENDER_WORLD"])
@pytest.mark.parametrize("shader", ["ShaderNodeBsdfPrincipled", "ShaderNodeBsdfGlass"])
def test_normals_below_the_surface_are_named(shader: str, space: Any) -> None:
    """For gloss over a diffuse base alone; in object and world space."""
    made = bs.material("M", (0.5, 0.5, 0.5), shader)
    bent = node(made.node_tree, "NormalMap", space=space)
    bent.inputs["Color"].default_value = (0.5, 0.5, 0.9, 1.0)
    made.node_tree.links.new(bent.outputs[0], bs.shader(made).inputs["Normal"])
    bs.add("Cube", bs.cube("Cube", made))
    named = any("point below the surface" in line for line in bs.export(bake=16).report.lines)
    assert named == (space != "TANGENT" and "Principled" in shader)
