"""What files of beginners have: old nodes, layers of data, instances, lamps and settings that few people touch."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np

from .. import stage
from ..case import case


def _small(width: float = 5.5) -> Any:
    """A small picture of the studio; returns Blender's scene."""
    stage.studio(width=width)
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 96, 72
    return scene


def _checks(name: str, space: str = "sRGB", size: int = 16, alpha: bool = False) -> Any:
    """An image of coloured squares, half transparent in stripes."""
    y, x = np.mgrid[0:size, 0:size]
    pixels = np.stack([0.2 + 0.6 * ((x // 4 + y // 4) % 2), x / size, y / size], axis=-1)
    if alpha:
        pixels = np.concatenate([pixels, 0.25 + 0.5 * ((x // 2) % 2)[..., None]], axis=-1)
    return stage.image(name, pixels, space)


def _textured(name: str, image: Any, socket: str = "Color", **settings: Any) -> Any:
    def shader(tree: Any) -> Any:
        texture = stage.node(tree, "ShaderNodeTexImage", image=image, **settings)
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": texture.outputs[socket]})

    return stage.material(name, shader)


@case("Alpha modes of images: straight, premultiplied, packed channels, none; colour and alpha", bounces=2)
def alpha_modes() -> None:
    """Stickers and masks."""
    _small()
    for k, mode in enumerate(("STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE")):
        for j, socket in enumerate(("Color", "Alpha")):
            image = _checks(f"{mode} {socket}", alpha=True)
            image.alpha_mode = mode
            card = stage.plane(f"{mode} {socket}", _textured(f"{mode} {socket}", image, socket), size=0.9)
            stage.add(f"{mode} {socket}", card, (-1.6 + 1.05 * k, 1.1 * j - 0.5, 0.05), (0.3, 0, 0))


@case("Colour spaces of images: Raw, Filmic, AgX, ACEScg, Rec.2020, Display P3, XYZ, of bytes and floats", bounces=2)
def color_spaces() -> None:
    """Images as other programs wrote them."""
    _small()
    known = {one.identifier for one in bpy.types.ColorManagedInputColorspaceSettings.bl_rna.properties["name"].enum_items}
    wanted = ("Raw", "Non-Color", "Filmic sRGB", "AgX Base sRGB", "AgX Log", "ACEScg", "Linear Rec.2020", "Display P3",
              "Linear CIE-XYZ D65", "Rec.1886")  # fmt: skip
    for k, space in enumerate(name for name in wanted if name in known):
        y, x = np.mgrid[0:8, 0:8] / 8.0
        pixels = np.stack([0.1 + 0.7 * x, 0.1 + 0.5 * y, 0.4 - 0.3 * x * y], axis=-1).astype(np.float32)
        image = stage.image(space, pixels, space, is_float=k % 2 == 1)
        card = stage.plane(space, _textured(space, image), size=0.75)
        stage.add(space, card, (-1.7 + 0.85 * (k % 5), 0.9 * (k // 5) - 0.4, 0.05), (0.3, 0, 0))


@case("Several UV maps and colour layers: active, for rendering, named, missing, after a Join", bounces=2)
def several_layers() -> None:
    """The second map is for rendering; the first is active."""
    _small()

    def by(name: str, layer: str | None) -> Any:
        def shader(tree: Any) -> Any:
            texture = stage.node(tree, "ShaderNodeTexImage", image=_checks(name), interpolation="Closest")
            if layer is not None:
                where = stage.node(tree, "ShaderNodeUVMap", uv_map=layer)
                tree.links.new(where.outputs[0], texture.inputs[0])
            return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": texture.outputs[0]})

        return stage.material(name, shader)

    def colored(name: str, layer: str, kind: str) -> Any:
        def shader(tree: Any) -> Any:
            if kind == "VERTEX":
                read = stage.node(tree, "ShaderNodeVertexColor", layer_name=layer)
            else:
                read = stage.node(tree, "ShaderNodeAttribute", attribute_name=layer)
            return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": read.outputs[0]})

        return stage.material(name, shader)

    made = [by("Default", None), by("First", "UVMap"), by("Second", "Second"), by("Missing", "gone"),
            colored("Empty name", "", "VERTEX"), colored("Byte", "Byte", "VERTEX"), colored("Float", "Float", "ATTRIBUTE"),
            colored("No layer", "gone", "ATTRIBUTE")]  # fmt: skip
    for k, one in enumerate(made):
        mesh = stage.grid(one.name, one, size=0.9, cells=2)
        second = mesh.uv_layers.new(name="Second")
        for j, uv in enumerate(second.data):
            uv.uv = (0.3 + 0.4 * mesh.uv_layers[0].data[j].uv[1], 2.0 * mesh.uv_layers[0].data[j].uv[0])
        second.active_render, mesh.uv_layers.active_index = True, 0
        byte = mesh.color_attributes.new("Byte", "BYTE_COLOR", "CORNER")
        floats = mesh.color_attributes.new("Float", "FLOAT_COLOR", "POINT")
        for j, value in enumerate(byte.data):
            value.color = (0.2 + 0.1 * (j % 7), 0.6, 0.1 * (j % 5), 1.0)
        for j, value in enumerate(floats.data):
            value.color = (0.9 - 0.1 * j, 0.2, 0.1 * j, 0.5)
        mesh.color_attributes.active_color_index, mesh.color_attributes.render_color_index = 0, 1
        stage.add(one.name, mesh, (-1.6 + 1.05 * (k % 4), 1.1 * (k // 4) - 0.5, 0.05), (0.3, 0, 0))


@case("Skies and panoramas within materials; profiles and gradients in emission", bounces=3, samples=64)
def skies_in_materials() -> None:
    """Fake reflections."""
    _small()

    def shader_of(kind: str, where: str, **settings: Any) -> Any:
        def shader(tree: Any) -> Any:
            place = stage.node(tree, "ShaderNodeTexCoord").outputs[where]
            texture = stage.node(tree, kind, **settings)
            tree.links.new(place, texture.inputs[0])
            return stage.node(tree, "ShaderNodeEmission", {"Color": texture.outputs[0], "Strength": 0.4})

        return stage.material(f"{kind} {where}", shader)

    panorama = stage.image("Around", np.random.default_rng(3).uniform(0.1, 0.9, (8, 16, 3)).astype(np.float32),
                           "Linear Rec.709", is_float=True)  # fmt: skip
    stage.row([shader_of("ShaderNodeTexEnvironment", "Normal", image=panorama),
               shader_of("ShaderNodeTexEnvironment", "Reflection", image=panorama),
               shader_of("ShaderNodeTexEnvironment", "Generated", image=panorama, projection="MIRROR_BALL"),
               shader_of("ShaderNodeTexGradient", "Reflection", gradient_type="SPHERICAL")], segments=32)  # fmt: skip


@case("Worlds: two Backgrounds mixed by the direction, one added, an Emission and a Transparent shader", bounces=2)
def world_mixes() -> None:
    """Horizon lines of tutorials."""
    _small()
    tree = bpy.context.scene.world.node_tree
    where = stage.node(tree, "ShaderNodeSeparateXYZ", {0: stage.node(tree, "ShaderNodeNewGeometry").outputs["Incoming"]})
    up = stage.node(tree, "ShaderNodeMath", {0: where.outputs[2], 1: -0.1}, operation="LESS_THAN")
    low = stage.node(tree, "ShaderNodeBackground", {"Color": (0.3, 0.2, 0.1), "Strength": 0.5})
    high = stage.node(tree, "ShaderNodeEmission", {"Color": (0.2, 0.4, 0.8), "Strength": 0.7})
    mixed = stage.node(tree, "ShaderNodeMixShader", {0: up, 1: low, 2: high})
    faint = stage.node(tree, "ShaderNodeMixShader", {0: 0.3, 1: mixed, 2: stage.node(tree, "ShaderNodeBsdfTransparent")})
    whole = stage.node(tree, "ShaderNodeAddShader", {0: faint, 1: stage.node(tree, "ShaderNodeBackground", {0: (0.1, 0.0, 0.1)})})
    tree.links.new(whole.outputs[0], tree.nodes["World Output"].inputs[0])
    stage.row([stage.diffuse("Chalk"), stage.principled("Metal", Metallic=1.0, Roughness=0.15), stage.principled("Plastic")])


@case("Normal maps in object, world and Blender's spaces, of a missing map, beside Normal and Vector Transform nodes",
      samples=64)  # fmt: skip
def normal_spaces() -> None:
    """Baked by other programs."""
    _small()
    generator = np.random.default_rng(2)
    tilted = np.concatenate([0.15 * generator.uniform(-1, 1, (16, 16, 2)), np.full((16, 16, 1), 0.9)], axis=-1)
    v, u = ((np.mgrid[0:128, 0:256] + 0.5).T / (128, 256)).T
    turn, height = 2.0 * np.pi * (u - 0.5), np.pi * (0.5 - v)
    around = np.stack([np.cos(height) * np.cos(turn), np.cos(height) * np.sin(turn), np.sin(height)], axis=-1)
    around += 0.3 * np.sin(24.0 * np.pi * u)[..., None] * np.stack([-np.sin(turn), np.cos(turn), 0.0 * turn], axis=-1)
    around /= np.linalg.norm(around, axis=-1, keepdims=True)
    maps = {"TANGENT": tilted, "OBJECT": around, "BLENDER_OBJECT": around * (1, -1, -1)}
    images = {space: stage.image(space, 0.5 + 0.5 * vectors, "Non-Color") for space, vectors in maps.items()}

    def mapped(space: str, uv: str = "", strength: float = 1.0) -> Any:
        def shader(tree: Any) -> Any:
            texture = stage.node(tree, "ShaderNodeTexImage", image=images[space.replace("WORLD", "OBJECT")])
            normal = stage.node(tree, "ShaderNodeNormalMap", {"Color": texture.outputs[0], "Strength": strength},
                                space=space, uv_map=uv)  # fmt: skip
            return stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": (0.5, 0.5, 0.6), "Normal": normal})

        return stage.material(f"{space} {uv} {strength}", shader)

    def turned(tree: Any) -> Any:
        normal = stage.node(tree, "ShaderNodeNewGeometry").outputs["Normal"]
        moved = stage.node(tree, "ShaderNodeVectorTransform", {0: normal}, vector_type="NORMAL", convert_from="WORLD",
                           convert_to="CAMERA")  # fmt: skip
        dot = stage.node(tree, "ShaderNodeNormal", {0: moved})
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": stage.node(tree, "ShaderNodeMixRGB", {
            0: dot.outputs["Dot"], 1: (0.1, 0.2, 0.6), 2: (0.8, 0.5, 0.2)})})  # fmt: skip

    stage.row([mapped("OBJECT"), mapped("WORLD"), mapped("BLENDER_OBJECT"), mapped("BLENDER_WORLD")], y=-0.6, radius=0.5)
    stage.row([mapped("TANGENT", "gone"), mapped("TANGENT", "", 2.5), stage.material("Turned", turned)], y=0.8, radius=0.5)


@case("Mappings of old files: a texture's own mapping and colours, all types of Mapping, groups within groups", bounces=2)
def old_mappings() -> None:
    """Values that the interface no longer shows."""
    _small()
    image = _checks("Checks")

    def own(tree: Any) -> Any:
        texture = stage.node(tree, "ShaderNodeTexImage", image=image)
        mapping, colors = texture.texture_mapping, texture.color_mapping
        mapping.scale, mapping.translation, mapping.rotation = (2.0, 0.5, 1.0), (0.2, 0.1, 0.0), (0.0, 0.0, 0.4)
        mapping.vector_type = "POINT"
        colors.brightness, colors.contrast, colors.saturation = 1.3, 0.8, 0.5
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": texture.outputs[0]})

    def mapped(kind: str) -> Any:
        def shader(tree: Any) -> Any:
            where = stage.node(tree, "ShaderNodeMapping", {
                "Vector": stage.node(tree, "ShaderNodeTexCoord").outputs["Generated"],
                "Rotation": (0.3, 0.2, 0.5), "Scale": (3.0, 0.5, -1.5)}, vector_type=kind)  # fmt: skip
            return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": stage.node(tree, "ShaderNodeTexChecker", {
                "Vector": where, "Scale": 2.0})})  # fmt: skip

        return stage.material(kind, shader)

    def nested(tree: Any) -> Any:
        inner = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
        outer = bpy.data.node_groups.new("Outer", "ShaderNodeTree")
        for group in (inner, outer):
            group.interface.new_socket("Tone", in_out="INPUT", socket_type="NodeSocketColor")
            group.interface.new_socket("Power", in_out="INPUT", socket_type="NodeSocketFloat")
            group.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketColor")
        start, end = inner.nodes.new("NodeGroupInput"), inner.nodes.new("NodeGroupOutput")
        gamma = stage.node(inner, "ShaderNodeGamma", {0: start.outputs[0], 1: start.outputs[1]})
        inner.links.new(gamma.outputs[0], end.inputs[0])
        start, end = outer.nodes.new("NodeGroupInput"), outer.nodes.new("NodeGroupOutput")
        twice = [stage.node(outer, "ShaderNodeGroup", node_tree=inner) for _ in range(2)]
        outer.links.new(start.outputs[0], twice[0].inputs[0])
        outer.links.new(start.outputs[1], twice[0].inputs[1])
        outer.links.new(twice[0].outputs[0], twice[1].inputs[0])
        twice[1].inputs[1].default_value = 0.5
        outer.links.new(twice[1].outputs[0], end.inputs[0])
        used = stage.node(tree, "ShaderNodeGroup", node_tree=outer)
        used.inputs[0].default_value, used.inputs[1].default_value = (0.7, 0.3, 0.2, 1.0), 2.2
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": used.outputs[0]})

    stage.add("Own", stage.plane("Own", stage.material("Own", own), size=1.2), (-1.4, 0.9, 0.1), (0.4, 0, 0))
    stage.add("Nested", stage.sphere("Nested", stage.material("Nested", nested), radius=0.5), (0.4, 0.9, 0.5))
    stage.row([mapped(kind) for kind in ("POINT", "TEXTURE", "VECTOR", "NORMAL")], y=-0.6, radius=0.5)


@case("Principled at its limits: parts that exclude each other, indices of 1 and below, negative and large values",
      bounces=6, samples=96)  # fmt: skip
def odd_principled() -> None:
    """Sliders that were pulled."""
    _small()
    stage.row([stage.principled("Both", (0.8, 0.5, 0.2), Metallic=0.5, Transmission_Weight=0.5, Roughness=0.2),
               stage.principled("One", (0.8, 0.5, 0.2), IOR=1.0, Roughness=0.3),
               stage.principled("Below", (0.6, 0.7, 0.8), IOR=0.8, Transmission_Weight=1.0, Roughness=0.1),
               stage.principled("Negative", (-0.2, 0.5, 0.2), Roughness=-0.5, Specular_IOR_Level=-1.0)],
              y=-0.6, radius=0.5)  # fmt: skip
    stage.row([stage.principled("Much", (0.5, 0.5, 0.5), Specular_IOR_Level=4.0, Coat_Weight=2.0, Sheen_Weight=1.5),
               stage.principled("Ghost", (0.5, 0.5, 0.5), Alpha=0.4, Emission_Color=(0.2, 0.8, 0.3, 1.0),
                                Emission_Strength=1.0),
               stage.principled("Turned", (0.8, 0.8, 0.8), Metallic=1.0, Anisotropic=0.9, Anisotropic_Rotation=0.3,
                                Roughness=0.3)], y=0.8, radius=0.5)  # fmt: skip


@case("Settings of materials and objects: emission that is not sampled, front or back; terminators; pass numbers",
      bounces=3, samples=96)  # fmt: skip
def material_settings() -> None:
    """Panels below the nodes."""
    _small()
    for k, how in enumerate(("NONE", "FRONT", "BACK", "FRONT_BACK")):
        glow = stage.emitter(how, (1.0, 0.6 - 0.1 * k, 0.2 * k), 2.0)
        glow.cycles.emission_sampling = how
        stage.add(how, stage.plane(how, glow, size=0.7), (-1.6 + 1.05 * k, 0.9, 0.7), (1.2, 0, 0.3 * k))
    for k, (shading, geometry) in enumerate(((0.0, 0.0), (0.5, 0.1), (0.1, 0.5))):
        ball = stage.sphere(f"Ball {k}", stage.diffuse(f"Ball {k}"), radius=0.45, segments=12)
        ob = stage.add(f"Ball {k}", ball, (-1.2 + 1.2 * k, -0.5, 0.45))
        ob.shadow_terminator_shading_offset, ob.shadow_terminator_geometry_offset = shading, geometry


@case("Simplify: smaller textures, culling of objects outside the camera, fewer children of hair", bounces=2)
def simplified_textures() -> None:
    """Render ▸ Simplify ▸ Render."""
    scene = _small()
    scene.render.use_simplify = True
    scene.cycles.texture_limit_render = "128"
    fine = np.random.default_rng(0).uniform(0.0, 1.0, (512, 512, 1)) * np.ones(3)
    stage.row([_textured("Fine", stage.image("Fine", fine > 0.7))])
    stage.add("Card", stage.plane("Card", _textured("Near", bpy.data.images["Fine"]), size=1.2), (1.3, -0.2, 0.3), (0.5, 0, 0))
    scene.cycles.use_camera_cull = True
    aside = stage.add("Aside", stage.cube("Aside", stage.diffuse("Aside"), size=2.0), (-3.6, -1.5, 1.0))
    aside.cycles.use_camera_cull = True


@case("A camera with a scaled and mirrored parent; half resolution; a region without crop", bounces=2)
def camera_rig() -> None:
    """Rigs of others."""
    scene = _small()
    stage.row([stage.diffuse("Chalk"), stage.principled("Plastic", (0.2, 0.4, 0.7)), stage.principled("Other", (0.7, 0.4, 0.2))])
    rig = stage.add("Rig", None, (0.2, 0.1, 0.0), (0.0, 0.0, 0.2), (-1.5, 1.5, 1.5))
    scene.camera.parent = rig
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 192, 144, 50
    scene.render.use_border = True
    scene.render.border_min_x, scene.render.border_max_x = 0.2, 0.9
    scene.render.border_min_y, scene.render.border_max_y = 0.1, 0.8


@case("Gabor and White Noise, detail above 15, Voronoi in four dimensions, gradients of all types", bounces=2, samples=64)
def rare_textures() -> None:
    """Procedural textures with unusual settings."""
    _small()

    def of(kind: str, inputs: Any = None, output: int = 0, **settings: Any) -> Any:
        def shader(tree: Any) -> Any:
            texture = stage.node(tree, kind, inputs, **settings)
            if "Vector" in texture.inputs and texture.inputs["Vector"].enabled:
                tree.links.new(stage.node(tree, "ShaderNodeTexCoord").outputs["Generated"], texture.inputs["Vector"])
            return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": texture.outputs[output]})

        return stage.material(f"{kind} {settings}", shader)

    stage.row([of("ShaderNodeTexGabor", {"Scale": 4.0}), of("ShaderNodeTexWhiteNoise", {"W": 2.5}, 1, noise_dimensions="1D"),
               of("ShaderNodeTexVoronoi", {"W": 0.3, "Scale": 4.0}, 1, voronoi_dimensions="4D", feature="SMOOTH_F1"),
               of("ShaderNodeTexVoronoi", {"Scale": 4.0}, 0, feature="N_SPHERE_RADIUS")], y=-0.6, radius=0.5)  # fmt: skip
    stage.row([of("ShaderNodeTexNoise", {"Scale": 3.0, "Detail": 15.0, "Distortion": 2.0}, 1, normalize=False),
               of("ShaderNodeTexNoise", {"Scale": 3.0, "W": 1.2}, 0, noise_dimensions="4D", noise_type="HYBRID_MULTIFRACTAL"),
               of("ShaderNodeTexGradient", gradient_type="QUADRATIC_SPHERE"),
               of("ShaderNodeTexGradient", gradient_type="RADIAL")], y=0.8, radius=0.5)  # fmt: skip


@case("Lamps: no contribution to diffuse or glossy rays, no multiple importance, exposure, soft spots of huge size",
      bounces=3, samples=96)  # fmt: skip
def lamp_factors() -> None:
    """Settings of light data."""
    _small()
    bpy.data.objects["Key"].data.energy = 40.0
    for k, name in enumerate(("diffuse_factor", "specular_factor", "transmission_factor")):
        ob = stage.lamp("POINT", name, 25.0, (-1.6 + 1.6 * k, -1.0, 1.6), shadow_soft_size=0.15)
        setattr(ob.data, name, 0.0)
    huge = stage.lamp("SPOT", "Huge", 60.0, (0.0, 2.5, 3.0), (0, 0, 0), shadow_soft_size=1.5, spot_size=math.pi * 0.9)
    huge.data.cycles.use_multiple_importance_sampling = False
    if hasattr(huge.data, "exposure"):
        huge.data.exposure = -0.5
    stage.row([stage.diffuse("Chalk"), stage.principled("Metal", Metallic=1.0, Roughness=0.25), stage.principled("Plastic", Roughness=0.2)])


@case("Instances of instances by vertices and faces, parents that are scaled and mirrored, and text", bounces=2)
def nested_carriers() -> None:
    """A field of signs."""
    _small()
    post = stage.add("Post", stage.cube("Post", stage.principled("Post", (0.7, 0.3, 0.2)), size=0.2), (0, 0, 0))
    small = stage.add("Small", stage.grid("Small", size=0.5, cells=1), (0, 0, 0))
    small.instance_type, small.use_instance_vertices_rotation = "VERTS", True
    post.parent = small
    large = stage.add("Large", stage.grid("Large", size=1.6, cells=2), (-0.7, 0.2, 0.3), (0.2, 0.1, 0.3), (1.0, -1.4, 1.0))
    large.instance_type, large.use_instance_faces_scale, large.instance_faces_scale = "FACES", True, 1.2
    small.parent = large
    text = bpy.data.curves.new("Text", "FONT")
    text.body, text.size, text.extrude = "ab", 0.7, 0.05
    text.materials.append(stage.principled("Ink", (0.1, 0.2, 0.6)))
    carrier = stage.add("Carrier", stage.grid("Carrier", size=1.2, cells=1), (1.4, 0.0, 0.5), (0.6, 0, 0))
    carrier.instance_type = "VERTS"
    stage.add("Letters", text).parent = carrier


@case("Objects that no ray meets: grease pencil, empties, armatures, lattices, probes, an image, a speaker", bounces=2)
def helpers() -> None:
    """What rigs leave in a scene."""
    _small()
    stage.row([stage.diffuse("Chalk")])
    for k, make in enumerate((bpy.data.armatures, bpy.data.lattices, bpy.data.speakers)):
        stage.add(f"Helper {k}", make.new(f"Helper {k}"), (-1.5 + k, -0.5, 0.5))
    stage.add("Probe", bpy.data.lightprobes.new("Probe", "SPHERE"), (1.2, 0.0, 0.5))
    picture = stage.add("Reference", None, (1.2, -0.3, 0.4), (math.pi / 2, 0, 0))
    picture.empty_display_type, picture.data = "IMAGE", _checks("Reference")
