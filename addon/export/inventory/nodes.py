"""The settings and inputs of shader nodes, by node type.

`NODES` has the types that are read: the functions registered by `reads` and `shader` translate them. Inputs stand in it
by their identifiers, with _ for blanks. `EVALUATED_BY_CYCLES` has the types whose outputs Cycles bakes where no
function reads them, with all their settings.
"""

from __future__ import annotations

from .table import PASSES, VOLUMES, Named, Table

_LIGHTS = "only loops over lights use it, whose nodes are named where they are linked"

# Settings of all nodes of a kind: the colours of textures of Blender 2.7, which Cycles ignores, and a hidden input.
COMMON = Table(without={"Cycles ignores it": "color_mapping Weight"})

NODES: dict[str, Table] = {
    "ATTRIBUTE": Table("attribute_type attribute_name", without={_LIGHTS: "LightIndex"}),
    "BACKGROUND": Table("Color Strength"),
    "BEVEL": Table("samples Radius Normal"),
    "BLACKBODY": Table("Temperature"),
    "BRIGHTCONTRAST": Table("Color Bright Contrast"),
    "BSDF_DIFFUSE": Table("Color Roughness Normal"),
    "BSDF_GLASS": Table("distribution Color Roughness IOR Normal Thin_Film_Thickness Thin_Film_IOR",
                        named={"Anisotropy": Named("its glass is as rough in all directions", 0.0)},
                        without={"only 'Anisotropy' uses it, which is named": "Rotation Tangent"}),
    "BSDF_GLOSSY": Table("distribution Color Roughness Anisotropy Rotation Normal Tangent"),
    "BSDF_HAIR": Table("component Color Offset RoughnessU RoughnessV Tangent"),
    "BSDF_HAIR_PRINCIPLED": Table(
        "model parametrization Color Melanin Melanin_Redness Tint Absorption_Coefficient Aspect_Ratio Roughness "
        "Radial_Roughness Coat IOR Offset Random_Color Random_Roughness Random R_lobe TT_lobe TRT_lobe"),
    "BSDF_PRINCIPLED": Table(
        "distribution subsurface_method Base_Color Metallic Roughness IOR Alpha Normal Diffuse_Roughness "
        "Subsurface_Weight Subsurface_Radius Subsurface_Scale Subsurface_IOR Subsurface_Anisotropy Specular_IOR_Level "
        "Specular_Tint Anisotropic Anisotropic_Rotation Tangent Transmission_Weight Coat_Weight Coat_Roughness "
        "Coat_IOR Coat_Tint Coat_Normal Sheen_Weight Sheen_Roughness Sheen_Tint Emission_Color Emission_Strength "
        "Thin_Film_Thickness Thin_Film_IOR Thin_Wall",
        named={"Transmission_Dispersion_Scale": Named("its dispersion is left out", 0.0)},
        without={"only dispersion uses it, which is named": "Transmission_Dispersion_Abbe_Number"}),
    "BSDF_RAY_PORTAL": Table("Color Position Direction"),
    "BSDF_REFRACTION": Table("distribution Color Roughness IOR Normal"),
    "BSDF_SHEEN": Table("distribution Color Roughness Normal"),
    "BSDF_TOON": Table("component Color Size Smooth Normal"),
    "BSDF_TRANSLUCENT": Table("Color Normal"),
    "BSDF_TRANSPARENT": Table("Color"),
    "BUMP": Table("invert Strength Distance Filter_Width Height Normal"),
    "CLAMP": Table("clamp_type Value Min Max"),
    "COMBINE_COLOR": Table("mode Red Green Blue"),
    "COMBXYZ": Table("X Y Z"),
    "CURVE_FLOAT": Table("mapping Factor Value"),
    "CURVE_RGB": Table("mapping Fac Color"),
    "CURVE_VEC": Table("mapping Fac Vector"),
    "EMISSION": Table("Color Strength"),
    "FRESNEL": Table("IOR Normal"),
    "GAMMA": Table("Color Gamma"),
    "HOLDOUT": Table(),
    "HUE_SAT": Table("Hue Saturation Value Fac Color"),
    "INVERT": Table("Fac Color"),
    "LAYER_WEIGHT": Table("Blend Normal"),
    "LIGHT_PATH": Table(),
    "MAPPING": Table("vector_type Vector Location Rotation Scale"),
    "MAP_RANGE": Table("clamp interpolation_type data_type Value From_Min From_Max To_Min To_Max Steps Vector "
                       "From_Min_FLOAT3 From_Max_FLOAT3 To_Min_FLOAT3 To_Max_FLOAT3 Steps_FLOAT3"),
    "MATH": Table("operation use_clamp Value Value_001 Value_002"),
    "MIX": Table("data_type factor_mode blend_type clamp_factor clamp_result Factor_Float Factor_Vector "
                 "A_Float B_Float A_Vector B_Vector A_Color B_Color A_Rotation B_Rotation"),
    "MIX_RGB": Table("blend_type use_alpha use_clamp Fac Color1 Color2"),
    "NEW_GEOMETRY": Table(),
    "NORMAL": Table("Normal"),
    "NORMAL_MAP": Table(
        "space uv_map Strength Color",
        named={"convention": Named("its green channel is read as that of OpenGL, not of {value}", "OPENGL"),
               "base": Named("it is relative to the displaced surface, not to the {value} one", "DISPLACED")}),
    "OBJECT_INFO": Table(),
    "RGB": Table(),
    "RGBTOBW": Table("Color"),
    "SEPARATE_COLOR": Table("mode Color"),
    "SEPXYZ": Table("Vector"),
    "SUBSURFACE_SCATTERING": Table("falloff Color Scale Radius IOR Roughness Anisotropy Normal"),
    "TANGENT": Table("direction_type axis uv_map"),
    "TEX_BRICK": Table("texture_mapping offset_frequency squash_frequency offset squash Vector Color1 Color2 Mortar "
                       "Scale Mortar_Size Mortar_Smooth Bias Brick_Width Row_Height"),
    "TEX_CHECKER": Table("texture_mapping Vector Color1 Color2 Scale"),
    "TEX_COORD": Table("object from_instancer"),
    "TEX_GRADIENT": Table("texture_mapping gradient_type Vector"),
    "TEX_MAGIC": Table("texture_mapping turbulence_depth Vector Scale Distortion"),
    "TEX_NOISE": Table("texture_mapping noise_dimensions noise_type normalize Vector W Scale Detail Roughness "
                       "Lacunarity Offset Gain Distortion"),
    "TEX_VORONOI": Table("texture_mapping voronoi_dimensions distance feature normalize Vector W Scale Detail "
                         "Roughness Lacunarity Smoothness Exponent Randomness"),
    "TEX_WAVE": Table("texture_mapping wave_type bands_direction rings_direction wave_profile Vector Scale "
                      "Distortion Detail Detail_Scale Detail_Roughness Phase_Offset"),
    "TEX_WHITE_NOISE": Table("noise_dimensions Vector W"),
    "VALTORGB": Table("color_ramp Fac"),
    "VALUE": Table(),
    "VECTOR_ROTATE": Table("rotation_type invert Vector Center Axis Angle Rotation"),
    "VECT_MATH": Table("operation Vector Vector_001 Vector_002 Scale"),
    "VECT_TRANSFORM": Table("vector_type convert_from convert_to Vector", without={_LIGHTS: "LightIndex"}),
    "VERTEX_COLOR": Table("layer_name"),
    "BSDF_METALLIC": Table(
        "distribution fresnel_type Base_Color Edge_Tint IOR Extinction Roughness Anisotropy Rotation Normal Tangent "
        "Thin_Film_Thickness Thin_Film_IOR"),
    "TEX_ENVIRONMENT": Table("image image_user texture_mapping projection interpolation Vector"),
    "TEX_IMAGE": Table("image image_user texture_mapping projection interpolation projection_blend extension Vector"),
    "CAMERA": Table(),
    # Until Blender 4.x:
    "COMBHSV": Table("H S V"),
    "COMBRGB": Table("R G B"),
    "SEPHSV": Table("Color"),
    "SEPRGB": Table("Image"),
    "HAIR_INFO": Table(),
    "POINT_INFO": Table(),
    "PARTICLE_INFO": Table(),
    "VOLUME_INFO": Table(),
    "WIREFRAME": Table("use_pixel_size Size"),
    "SCRIPT": Table("script filepath mode use_auto_update bytecode bytecode_hash"),
    "DISPLACEMENT": Table("space Height Midlevel Scale Normal"),
    "VECTOR_DISPLACEMENT": Table("space Vector Midlevel Scale"),
    "UVMAP": Table("uv_map from_instancer"),
}  # fmt: skip

# Followed by `nodes.feed` and `shaders.parts`.
FOLLOWED = frozenset(("GROUP", "ADD_SHADER", "MIX_SHADER", "OUTPUT_MATERIAL", "OUTPUT_WORLD", "OUTPUT_LIGHT"))

EVALUATED_BY_CYCLES = frozenset((
    "AMBIENT_OCCLUSION", "SHADERTORGB", "SQUEEZE", "TEX_GABOR", "TEX_IES",
    "TEX_POINTDENSITY", "TEX_SKY", "ShaderNodeRadialTiling", "WAVELENGTH", "LIGHT_FALLOFF", "MATERIAL_RAYCAST",
))  # fmt: skip

# Read as a whole (approximated/volumes.py).
VOLUME_NODES = frozenset(("VOLUME_ABSORPTION", "VOLUME_COEFFICIENTS", "VOLUME_SCATTER", "PRINCIPLED_VOLUME"))

# Reason -> types that change nothing in the picture, or whose effect is read or named where they are linked.
WITHOUT: dict[str, frozenset[str]] = {
    PASSES: frozenset(("OUTPUT_AOV",)),
    "it cannot be read, which is named where it is linked": frozenset((
        "LIGHT_ACCUMULATION", "LIGHT_EVALUATION", "LIGHT_INFO", "LIGHT_ITER_INTERNAL_INPUT",
        "LIGHT_ITER_INTERNAL_OUTPUT", "SHADOW_RAYCAST")),
    "Cycles renders it black": frozenset(("EEVEE_SPECULAR",)),
    "only Freestyle uses it": frozenset(("OUTPUT_LINESTYLE", "UVALONGSTROKE")),
    VOLUMES: VOLUME_NODES | {"VOLUME_INFO"},
}  # fmt: skip
