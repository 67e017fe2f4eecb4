"""What the export replaces by other parts of a scene: coats, holdouts, backdrops, lamps; window coordinates."""

# ruff: noqa: E402  (what is imported below needs bpy)

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from edgegrad import expression as e
from edgegrad_addon.export.bakes.bake import new_scene
from edgegrad_addon.export.exported import Export, Source
from edgegrad_addon.export.geometry import attributes, hashes
from edgegrad_addon.export.materials.coats import COSINES, reflected
from edgegrad_addon.export.surroundings import lamp_bake
from edgegrad_addon.export.surroundings.directed_lamps import replace_light, shown_area
from tests.support.scenes import blender_scenes as bs


@pytest.fixture(autouse=True)
def _scene() -> None:
    bs.empty()
    bs.camera()


def rendered(made: Export, spp: int = 16, depth: int = 2) -> Any:
    """The picture of an export."""
    made.scene.validate()
    return edgegrad.Renderer(made.scene).render(spp=spp, max_depth=depth)


def coated(**inputs: Any) -> Any:
    """A coated material with a strongly bent normal."""
    return bs.normal_mapped(1.0, "ShaderNodeBsdfPrincipled", **{"Coat Weight": 1.0, **inputs})


def test_a_coat_over_a_bent_normal_is_a_layer_with_the_smooth_normal() -> None:
    bs.add("Plane", bs.plane("Plane", 20.0, coated(Alpha=0.5)))
    made = bs.export()
    mixture = made.scene.materials["Bent"]
    base, coat, clear = (made.scene.materials[key] for key in mixture.parts)
    assert base.coat_weight == 0.0 and "normal" in base.textures and base.alpha == 1.0
    assert coat.coat_weight == 1.0 and "normal" not in coat.textures and not coat.base_color.any()
    assert clear.kind == "TRANSPARENT" and mixture.weights[1:] == pytest.approx([0.5, 0.5])
    assert not made.report.lines


def test_a_coat_with_a_tint_over_a_bent_normal_is_named() -> None:
    bs.add("Plane", bs.plane("Plane", 20.0, coated(**{"Coat Tint": (1.0, 0.5, 0.2, 1.0)})))
    made = bs.export()
    assert isinstance(made.scene.materials["Bent"], edgegrad.Material)
    assert any("coat uses the normal of the base" in line and "tint" in line for line in made.report.lines)


@pytest.mark.parametrize(("roughness", "ior"), [(0.0, 1.5), (0.3, 1.5), (0.3, 2.2), (0.7, 1.5)])
@pytest.mark.parametrize("degrees", [0.0, 40.0, 75.0])
def test_what_a_coat_reflects_is_what_dims_emission_below_it(roughness: float, ior: float, degrees: float) -> None:
    angle = np.deg2rad(degrees)
    to_world = np.eye(4)
    to_world[:3, :3] = [[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]]
    to_world[:3, 3] = 5.0 * to_world[:3, 2]
    square = edgegrad.Mesh(np.array([[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], float),
                           np.array([[0, 1, 2], [0, 2, 3]], np.int32), materials=("coat",))  # fmt: skip
    coat = edgegrad.Material(np.zeros(3), emission=np.ones(3), specular_ior_level=0.0, coat_weight=1.0,
                             coat_roughness=roughness, coat_ior=ior)  # fmt: skip
    scene = edgegrad.Scene(edgegrad.Camera(to_world, width=4, height=4, kind="ORTHOGRAPHIC", ortho_width=0.01),
                           {"square": square}, {"coat": coat})  # fmt: skip
    passed = edgegrad.render(scene, spp=1, max_depth=1).mean()
    expected = 1.0 - np.interp(np.cos(angle), np.linspace(0.0, 1.0, COSINES), reflected(roughness, ior))
    assert passed == pytest.approx(expected, abs=5e-3)  # native tables are coarse


def test_a_holdout_is_black_for_the_camera_alone() -> None:
    glow = bs.material("Glow", (1.0, 1.0, 1.0), "ShaderNodeEmission", Strength=5.0)
    bs.add("Hole", bs.plane("Hole", 0.5, glow), (0, 0, 1)).is_holdout = True
    bs.add("Floor", bs.plane("Floor", 20.0, bs.material("Grey")))
    picture = rendered(bs.export())
    assert not picture[14:18, 14:18].any()
    assert picture[2:6, 14:18].min() > 0.0  # lit by the holdout


def test_window_coordinates_are_places_in_the_picture() -> None:
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y, scene.render.pixel_aspect_x = 24, 16, 1.5
    scene.camera.data.shift_x, scene.camera.data.shift_y = 0.2, -0.1
    made = bs.material("Window", (0.0, 0.0, 0.0), "ShaderNodeEmission")
    place = made.node_tree.nodes.new("ShaderNodeTexCoord")
    made.node_tree.links.new(place.outputs["Window"], bs.shader(made).inputs["Color"])
    bs.add("Plane", bs.plane("Plane", 50.0, made), rotation=(0.3, 0.2, 0.0))
    picture = rendered(bs.export(), spp=256)
    assert picture[:, :, 0] == pytest.approx(np.tile((np.arange(24) + 0.5) / 24, (16, 1)), abs=3e-3)
    assert picture[:, :, 1] == pytest.approx(np.tile((15.5 - np.arange(16))[:, None] / 16, (1, 24)), abs=3e-3)


def test_an_image_node_has_the_alpha_of_an_equal_node() -> None:
    """Cycles merges equal nodes, and premultiplies colours by an alpha that nothing uses."""
    image = bpy.data.images.new("Leaf", 4, 4, alpha=True)
    made = bs.material("Leaf", (0.0, 0.0, 0.0), "ShaderNodeBsdfPrincipled")
    tree = made.node_tree
    color, alpha = (tree.nodes.new("ShaderNodeTexImage") for _ in range(2))
    color.image = alpha.image = image
    tree.links.new(color.outputs["Color"], bs.shader(made).inputs["Base Color"])
    tree.links.new(alpha.outputs["Alpha"], bs.shader(made).inputs["Alpha"])
    bs.add("Plane", bs.plane("Plane", 2.0, made)).data.uv_layers.new(name="UVMap")

    def mode() -> str:
        texture = bs.export().scene.materials["Leaf"].textures["base_color"]
        return next(node.alpha for node in e.nodes_of(texture) if isinstance(node, e.ImageTexture))

    assert mode() == "STRAIGHT"
    alpha.extension = "CLIP"
    assert mode() == "PREMULTIPLIED"


def test_bakes_are_made_at_the_frame_of_the_scene() -> None:
    bpy.context.scene.frame_set(7, subframe=0.25)
    assert new_scene().frame_current_final == 7.25


def test_the_camera_sees_an_image_that_lights_nothing() -> None:
    def image(name: str, color: Any) -> Any:
        made = bpy.data.images.new(name, 4, 2, float_buffer=True)
        made.pixels.foreach_set(np.tile(np.array((*color, 1.0), np.float32), 8))
        made.update()
        return made

    bs.world((0, 0, 0))
    tree = bpy.context.scene.world.node_tree
    shown, light = (tree.nodes.new("ShaderNodeTexEnvironment") for _ in range(2))
    shown.image, light.image = image("Shown", (1.0, 0.5, 0.0)), image("Light", (0.0, 0.0, 0.8))
    mix, path = tree.nodes.new("ShaderNodeMix"), tree.nodes.new("ShaderNodeLightPath")
    mix.data_type = "RGBA"
    tree.links.new(path.outputs["Is Camera Ray"], mix.inputs[0])
    for socket, node in ((6, light), (7, shown)):
        tree.links.new(node.outputs[0], mix.inputs[socket])
    tree.links.new(mix.outputs[2], tree.nodes["Background"].inputs["Color"])
    bs.add("Plane", bs.plane("Plane", 1.5, bs.material("White", (1.0, 1.0, 1.0))))
    made = bs.export()
    picture = rendered(made, 64)
    assert picture[0, 0] == pytest.approx([1.0, 0.5, 0.0], abs=1e-5)
    assert picture[14:18, 14:18].mean(axis=(0, 1)) == pytest.approx([0.0, 0.0, 0.8], abs=0.02)
    assert not made.report.lines


def test_a_lamp_as_a_body_that_glows_lights_like_the_lamp() -> None:
    bs.add("Floor", bs.plane("Floor", 20.0, bs.material("Grey")))
    bs.light("POINT", location=(0.5, 0.3, 2.0), rotation=(0.4, 1.1, -0.3), energy=30.0, shadow_soft_size=0.02)
    plain, made = bs.export(), bs.export()
    replace_light(made, "Light", np.array([1.0, 0.5, 0.25]), np.ones((64, 128, 3)), 2.0)
    assert not made.scene.lights and made.scene.emitters == ["Light"]
    expected, picture = rendered(plain, 64), rendered(made, 256)
    assert picture / expected == pytest.approx(np.broadcast_to([1.0, 0.5, 0.25], picture.shape), rel=0.1)
    assert picture.mean(axis=(0, 1)) / expected.mean(axis=(0, 1)) == pytest.approx([1.0, 0.5, 0.25], rel=0.01)


def test_the_octahedron_shows_the_area_of_a_sphere_on_average() -> None:
    radius, height = 0.3, 64
    area = shown_area(radius * np.sqrt(np.pi / np.sqrt(3.0)), height)
    rise = np.pi * (0.5 - (np.arange(height) + 0.5) / height)
    assert np.average(area.mean(axis=1), weights=np.cos(rise)) == pytest.approx(np.pi * radius**2, rel=2e-3)


def test_a_lamp_with_a_profile_becomes_a_body_and_keeps_no_light(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lamp_bake, "DIRECTIONS", 128)  # Cycles takes half a minute for the 1024 of fits
    ob = bs.light("POINT", energy=5.0, rotation=(0.3, -0.9, 1.2))
    tree = ob.data.node_tree
    if tree is None or not ob.data.use_nodes:
        ob.data.use_nodes = True
        tree = ob.data.node_tree
    text = bpy.data.texts.new("profile.ies")
    text.write("IESNA:LM-63-1995\nTILT=NONE\n1 1000 1 3 1 1 2 0 0 0\n1 1 50\n0 45 90\n0\n900 500 0\n")
    profile = tree.nodes.new("ShaderNodeTexIES")
    profile.ies = text
    emission = next(node for node in tree.nodes if node.type == "EMISSION")
    tree.links.new(profile.outputs[0], emission.inputs["Strength"])
    bs.add("Floor", bs.plane("Floor", 20.0, bs.material("Grey")))
    made = bs.export()
    assert not made.scene.lights and not made.lights and not made.report.lines
    assert isinstance(made.meshes["Light"], Source) and made.meshes["Light"].part == "light"
    assert rendered(made, 64)[16, 16].min() > 0.0


def test_particles_whose_emitter_is_hidden_and_has_its_own_material() -> None:
    emitter = bs.add("Emitter", bs.plane("Emitter", 2.0, bs.material("Only here")))
    emitter.modifiers.new("Particles", "PARTICLE_SYSTEM")
    emitter.particle_systems[0].settings.render_type = "NONE"
    emitter.show_instancer_for_render = False
    bs.add("Cube", bs.cube("Cube", bs.material("Grey")))
    assert list(bs.export().scene.meshes) == ["Cube"]


def test_particles_have_their_values_and_other_objects_those_of_none() -> None:
    outputs = {"Index": 1, "Random": 1, "Age": 1, "Lifetime": 1, "Location": 3, "Size": 1, "Velocity": 3}
    spark = linked("ParticleInfo", "Velocity", "Base Color", {})
    tree = spark.data.materials[0].node_tree
    info = next(node for node in tree.nodes if node.type == "PARTICLE_INFO")
    added = tree.nodes.new("ShaderNodeEmission")
    total = info.outputs["Location"]
    for name in outputs:
        sum_ = tree.nodes.new("ShaderNodeVectorMath")
        tree.links.new(total, sum_.inputs[0])
        tree.links.new(info.outputs[name], sum_.inputs[1])
        total = sum_.outputs[0]
    tree.links.new(total, added.inputs["Color"])
    both = tree.nodes.new("ShaderNodeAddShader")
    output = tree.nodes["Material Output"].inputs["Surface"]
    tree.links.new(output.links[0].from_socket, both.inputs[0])
    tree.links.new(added.outputs[0], both.inputs[1])
    tree.links.new(both.outputs[0], output)
    emitter = bs.add("Emitter", bs.plane("Emitter", 2.0))
    emitter.modifiers.new("Particles", "PARTICLE_SYSTEM")
    settings = emitter.particle_systems[0].settings
    settings.count, settings.frame_start, settings.frame_end, settings.lifetime = 5, 1.0, 4.0, 30.0
    settings.render_type, settings.instance_object, settings.size_random = "OBJECT", spark, 0.5
    for frame in range(1, 9):
        bpy.context.scene.frame_set(frame)
    made = bs.export()
    assert not [line for line in made.report.lines if "Particle Info" in line]
    found: dict[str, list[Any]] = {name: [] for name in outputs}
    for mesh in made.scene.meshes.values():
        for name in outputs:
            key = attributes.PARTICLE + name
            if key in mesh.instance_attributes:
                found[name] += list(mesh.instance_attributes[key])
            elif key in mesh.attributes:
                found[name].append(mesh.attributes[key][0, 0])
    ob = emitter.evaluated_get(bpy.context.evaluated_depsgraph_get())
    particles = ob.particle_systems[0].particles
    true = {"Index": [(k,) for k in range(5)], "Age": [(8.0 - one.birth_time,) for one in particles],
            "Lifetime": [(one.lifetime,) for one in particles], "Location": [tuple(one.location) for one in particles],
            "Size": [(one.size,) for one in particles], "Velocity": [tuple(one.velocity) for one in particles],
            "Random": [(hashes.hash_words(np.array([k]), 0)[0] / hashes.WORD,) for k in range(5)]}  # fmt: skip
    for name, rows in true.items():
        none = hashes.hash_words(np.array([0]), 0)[0] / hashes.WORD if name == "Random" else 0.0
        expected = sorted([*rows, (none,) * outputs[name]])  # the cube itself is no particle
        assert np.allclose(sorted(map(tuple, found[name])), expected, atol=1e-5), name


def linked(kind: str, output: str, to: str, settings: dict[str, Any], **inputs: Any) -> Any:
    """A cube under a lamp whose Principled node has an input from a node; returns the object."""
    bs.light("POINT")
    material = bs.material("M", (0.5, 0.5, 0.5), "ShaderNodeBsdfPrincipled", **inputs)
    tree = material.node_tree
    node = tree.nodes.new("ShaderNode" + kind)
    for key, value in settings.items():
        setattr(node, key, value)
    tree.links.new(node.outputs[output], bs.shader(material).inputs[to])
    return bs.add("Cube", bs.cube("Cube", material))


@pytest.mark.parametrize("axis", ["X", "Y", "Z", ""])
def test_tangents_around_an_axis(axis: str) -> None:
    """Around an axis of the object, which is turned; without a node around its Z axis."""
    ob = linked("Tangent", "Tangent", "Tangent", {"axis": axis or "X"}, Anisotropic=0.5, Roughness=0.4)
    ob.rotation_euler = (0.5, 0.4, 0.3)
    if not axis:
        tree = bpy.data.materials["M"].node_tree
        tree.nodes.remove(tree.nodes["Tangent"])
    made = bs.export()
    assert made.report.lines == []
    m, mesh = made.scene.materials["M"], made.scene.meshes["Cube"]
    around = np.array(ob.matrix_world)[:3, "XYZ".index(axis or "Z")]
    corners = mesh.vertices[mesh.faces]
    found = mesh.attributes[m.normal_uv + ".tangent"]
    # The texture space of a cube is as wide along all axes.
    expected = np.cross(around, corners - corners.reshape(-1, 3).mean(axis=0))
    scale = np.linalg.norm(expected, axis=-1, keepdims=True) / np.linalg.norm(found[..., :3], axis=-1, keepdims=True)
    np.testing.assert_allclose(found[..., :3] * scale, expected * (-1.0 if axis == "Y" else 1.0), atol=1e-6)


def test_ambient_occlusion_is_baked_among_all_objects() -> None:
    linked("AmbientOcclusion", "AO", "Base Color", {"samples": 64})

    def brightness() -> float:
        made = bs.export(bake=32)
        assert made.report.lines == [] and "base_color" in made.scene.materials["M"].textures
        (image,) = made.scene.images.values()
        return float(image.pixels.mean())

    alone = brightness()
    bs.add("Roof", bs.cube("Roof", bs.material("Clay")), (0.0, 0.0, 2.5))
    assert brightness() < alone - 0.02
    bpy.data.objects["Roof"].visible_shadow = False
    assert brightness() == pytest.approx(alone, abs=0.005)


@pytest.mark.parametrize(("value", "expected"), [((0.1, 0.6, 0.3), (0.1, 0.6, 0.3)), (0.4, (0.4, 0.4, 0.4))])
def test_attributes_of_the_view_layer_are_constants(value: Any, expected: tuple[float, ...]) -> None:
    linked("Attribute", "Color", "Base Color", {"attribute_type": "VIEW_LAYER", "attribute_name": "accent"})
    bpy.context.scene["accent"] = value
    made = bs.export()
    assert made.report.lines == [] and made.scene.materials["M"].base_color == pytest.approx(expected)
    bpy.context.view_layer["accent"] = (0.2, 0.2, 0.9)  # before the scene's own
    assert bs.export().scene.materials["M"].base_color == pytest.approx((0.2, 0.2, 0.9))
