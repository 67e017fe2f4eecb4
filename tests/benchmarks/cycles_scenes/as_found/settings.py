"""Settings that few people touch: of materials, objects, cameras, lamps, instances and textures."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np

from .. import stage
from ..case import case
from .habits import checks, small, textured


@case(
    "Principled at its limits: parts that exclude each other, indices of 1 and below, negative and large values",
    bounces=6,
    samples=96,
)
def odd_principled() -> None:
    """Sliders that were pulled."""
    small()
    stage.row(
        [
            stage.principled("Both", (0.8, 0.5, 0.2), Metallic=0.5, Transmission_Weight=0.5, Roughness=0.2),
            stage.principled("One", (0.8, 0.5, 0.2), IOR=1.0, Roughness=0.3),
            stage.principled("Below", (0.6, 0.7, 0.8), IOR=0.8, Transmission_Weight=1.0, Roughness=0.1),
            stage.principled("Negative", (-0.2, 0.5, 0.2), Roughness=-0.5, Specular_IOR_Level=-1.0),
        ],
        y=-0.6,
        radius=0.5,
    )
    stage.row(
        [
            stage.principled("Much", (0.5, 0.5, 0.5), Specular_IOR_Level=4.0, Coat_Weight=2.0, Sheen_Weight=1.5),
            stage.principled(
                "Ghost", (0.5, 0.5, 0.5), Alpha=0.4, Emission_Color=(0.2, 0.8, 0.3, 1.0), Emission_Strength=1.0
            ),
            stage.principled(
                "Turned", (0.8, 0.8, 0.8), Metallic=1.0, Anisotropic=0.9, Anisotropic_Rotation=0.3, Roughness=0.3
            ),
        ],
        y=0.8,
        radius=0.5,
    )


@case(
    "Settings of materials and objects: emission that is not sampled, front or back; terminators",
    bounces=3,
    samples=96,
)
def material_settings() -> None:
    """Panels below the nodes."""
    small()
    for k, how in enumerate(("NONE", "FRONT", "BACK", "FRONT_BACK")):
        glow = stage.emitter(how, (1.0, 0.6 - 0.1 * k, 0.2 * k), 2.0)
        glow.cycles.emission_sampling = how
        stage.add(how, stage.plane(how, glow, size=0.7), (-1.6 + 1.05 * k, 0.9, 0.7), (1.2, 0, 0.3 * k))
    for k, (shading, geometry) in enumerate(((0.0, 0.0), (0.5, 0.1), (0.1, 0.5))):
        ball = stage.sphere(f"Ball {k}", stage.diffuse(f"Ball {k}"), radius=0.45, segments=12)
        ob = stage.add(f"Ball {k}", ball, (-1.2 + 1.2 * k, -0.5, 0.45))
        ob.shadow_terminator_shading_offset, ob.shadow_terminator_geometry_offset = shading, geometry


@case(
    "Simplify: smaller textures, culling of objects outside the camera",
    bounces=2,
)
def simplified_textures() -> None:
    """Render ▸ Simplify ▸ Render."""
    scene = small()
    scene.render.use_simplify = True
    scene.cycles.texture_limit_render = "128"
    fine = np.random.default_rng(0).uniform(0.0, 1.0, (512, 512, 1)) * np.ones(3)
    stage.row([textured("Fine", stage.image("Fine", fine > 0.7))])
    stage.add(
        "Card", stage.plane("Card", textured("Near", bpy.data.images["Fine"]), size=1.2), (1.3, -0.2, 0.3), (0.5, 0, 0)
    )
    scene.cycles.use_camera_cull = True
    aside = stage.add("Aside", stage.cube("Aside", stage.diffuse("Aside"), size=2.0), (-3.6, -1.5, 1.0))
    aside.cycles.use_camera_cull = True


@case("A camera with a scaled and mirrored parent; half resolution", bounces=2)
def camera_rig() -> None:
    """Rigs of others."""
    scene = small()
    stage.row(
        [
            stage.diffuse("Chalk"),
            stage.principled("Plastic", (0.2, 0.4, 0.7)),
            stage.principled("Other", (0.7, 0.4, 0.2)),
        ]
    )
    rig = stage.add("Rig", None, (0.2, 0.1, 0.0), (0.0, 0.0, 0.2), (-1.5, 1.5, 1.5))
    scene.camera.parent = rig
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 192, 144, 50


@case("Gabor, White Noise, noise of large detail, Voronoi in four dimensions, gradients", bounces=2, samples=64)
def rare_textures() -> None:
    """Procedural textures with unusual settings."""
    small()

    def of(kind: str, inputs: Any = None, output: int = 0, **settings: Any) -> Any:
        def shader(tree: Any) -> Any:
            texture = stage.node(tree, kind, inputs, **settings)
            if "Vector" in texture.inputs and texture.inputs["Vector"].enabled:
                tree.links.new(stage.node(tree, "ShaderNodeTexCoord").outputs["Generated"], texture.inputs["Vector"])
            return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": texture.outputs[output]})

        return stage.material(f"{kind} {settings}", shader)

    stage.row(
        [
            of("ShaderNodeTexGabor", {"Scale": 4.0}),
            of("ShaderNodeTexWhiteNoise", {"W": 2.5}, 1, noise_dimensions="1D"),
            of("ShaderNodeTexVoronoi", {"W": 0.3, "Scale": 4.0}, 1, voronoi_dimensions="4D", feature="SMOOTH_F1"),
            of("ShaderNodeTexVoronoi", {"Scale": 4.0}, 0, feature="N_SPHERE_RADIUS"),
        ],
        y=-0.6,
        radius=0.5,
    )
    stage.row(
        [
            of("ShaderNodeTexNoise", {"Scale": 3.0, "Detail": 15.0, "Distortion": 2.0}, 1, normalize=False),
            of(
                "ShaderNodeTexNoise",
                {"Scale": 3.0, "W": 1.2},
                0,
                noise_dimensions="4D",
                noise_type="HYBRID_MULTIFRACTAL",
            ),
            of("ShaderNodeTexGradient", gradient_type="QUADRATIC_SPHERE"),
            of("ShaderNodeTexGradient", gradient_type="RADIAL"),
        ],
        y=0.8,
        radius=0.5,
    )


@case(
    "Lamps: no contribution to diffuse or glossy rays, no multiple importance, exposure, soft spots of huge size",
    bounces=3,
    samples=96,
)
def lamp_factors() -> None:
    """Settings of light data."""
    small()
    bpy.data.objects["Key"].data.energy = 40.0
    for k, name in enumerate(("diffuse_factor", "specular_factor", "transmission_factor")):
        ob = stage.lamp("POINT", name, 25.0, (-1.6 + 1.6 * k, -1.0, 1.6), shadow_soft_size=0.15)
        setattr(ob.data, name, 0.0)
    huge = stage.lamp("SPOT", "Huge", 60.0, (0.0, 2.5, 3.0), (0, 0, 0), shadow_soft_size=1.5, spot_size=math.pi * 0.9)
    huge.data.cycles.use_multiple_importance_sampling = False
    if hasattr(huge.data, "exposure"):
        huge.data.exposure = -0.5
    stage.row(
        [
            stage.diffuse("Chalk"),
            stage.principled("Metal", Metallic=1.0, Roughness=0.25),
            stage.principled("Plastic", Roughness=0.2),
        ]
    )


@case("Instances of instances by vertices and faces, parents that are scaled and mirrored, and text", bounces=2)
def nested_carriers() -> None:
    """A field of signs."""
    small()
    post = stage.add("Post", stage.cube("Post", stage.principled("Post", (0.7, 0.3, 0.2)), size=0.2), (0, 0, 0))
    inner = stage.add("Small", stage.grid("Small", size=0.5, cells=1), (0, 0, 0.03))
    inner.instance_type, inner.use_instance_vertices_rotation = "VERTS", True
    post.parent = inner
    large = stage.add(
        "Large", stage.grid("Large", size=1.6, cells=2), (-0.7, 0.2, 0.3), (0.2, 0.1, 0.3), (1.0, -1.4, 1.0)
    )
    large.instance_type, large.use_instance_faces_scale, large.instance_faces_scale = "FACES", True, 1.2
    inner.parent = large
    text = bpy.data.curves.new("Text", "FONT")
    text.body, text.size, text.extrude = "ab", 0.7, 0.05
    text.materials.append(stage.principled("Ink", (0.1, 0.2, 0.6)))
    carrier = stage.add("Carrier", stage.grid("Carrier", size=1.2, cells=1), (1.4, 0.0, 0.5), (0.6, 0, 0))
    carrier.instance_type = "VERTS"
    stage.add("Letters", text).parent = carrier


@case("Objects that no ray meets: grease pencil, empties, armatures, lattices, probes, an image, a speaker", bounces=2)
def helpers() -> None:
    """What rigs leave in a scene."""
    small()
    stage.row([stage.diffuse("Chalk")])
    for k, make in enumerate((bpy.data.armatures, bpy.data.lattices, bpy.data.speakers)):
        stage.add(f"Helper {k}", make.new(f"Helper {k}"), (-1.5 + k, -0.5, 0.5))
    stage.add("Probe", bpy.data.lightprobes.new("Probe", "SPHERE"), (1.2, 0.0, 0.5))
    picture = stage.add("Reference", None, (1.2, -0.3, 0.4), (math.pi / 2, 0, 0))
    picture.empty_display_type, picture.data = "IMAGE", checks("Reference")
