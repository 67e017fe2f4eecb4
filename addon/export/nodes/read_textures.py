"""Translation of image and procedural texture nodes."""

from __future__ import annotations

from typing import Any

from edgegrad import expression as e
from edgegrad.expression import Operand
from edgegrad.expression import procedural as p

from ..geometry import attributes
from .expressions import INLINES, Reader, Unreadable, folded, number, reads
from .images import FROM_SRGB, MISSING, UnreadableImage, alpha_mode, is_missing
from .links import Groups, by_identifier, feed, is_computed_by_blender, is_implicit, label
from .read_inputs import object_normal

INTERPOLATIONS = {"Linear": "LINEAR", "Closest": "CLOSEST", "Cubic": "CUBIC", "Smart": "CUBIC"}


# Conversion of code values to linear light, as the table of a curve.
FROM_CODES = tuple((float(c),) * 3 for c in FROM_SRGB)


def _missing(reader: Reader, node: Any, groups: Groups) -> bool:
    """Whether a node has no image to read; Cycles renders a constant then."""
    if reader.images is None or not is_missing(node.image):
        return False
    name = "no image" if node.image is None else f"an image that is missing, '{node.image.name}'"
    reader.note(f"node '{label(node, groups)}' has {name}; it is magenta, as in Cycles")
    return True


def read_image(reader: Reader, node: Any, groups: Groups, codes: bool = False) -> str:
    """Read the image of a node, and return its name in the scene."""
    if node.image is None or reader.images is None:
        raise Unreadable(f"node '{label(node, groups)}' (no image)")
    try:
        return reader.images.read(node.image, codes)
    except UnreadableImage as error:
        raise Unreadable(f"node '{label(node, groups)}' (image '{node.image.name}' {error})") from None


def _interpolates_codes(reader: Reader, node: Any) -> bool:
    """Whether the code values of a node's image are interpolated, before they are converted to linear light."""
    # Cycles interpolates code values, and multiplies them by alpha.
    if node.image is None:
        return False
    multiplies = node.image.depth == 32 and alpha_mode(node.image, False) == "PREMULTIPLIED"
    if node.interpolation == "Closest" and not multiplies:
        return False
    return reader.images is not None and reader.images.interpolates_codes(node.image)


@reads("TEX_IMAGE")
def _image(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    pixel = reader.images if _missing(reader, node, groups) else None
    if pixel is not None and node.extension != "CLIP":  # without an end, a single pixel is a constant
        return 1.0 if output.identifier == "Alpha" else MISSING
    codes = pixel is None and _interpolates_codes(reader, node)
    name = read_image(reader, node, groups, codes) if pixel is None else pixel.missing()
    box = node.projection == "BOX"
    vector = _image_vector(reader, node, groups)
    value = e.ImageTexture(
        name, vector, INTERPOLATIONS[node.interpolation], node.extension, node.projection,
        alpha_mode(node.image, _uses_alpha(reader, node, groups, vector)) if pixel is None else "CHANNEL_PACKED",
        node.projection_blend,
        object_normal() if box else (0.0, 0.0, 1.0),
    )  # fmt: skip
    if output.identifier == "Alpha":
        return e.Channel(value, 3)
    return e.Curves(value, FROM_CODES) if codes else value


def _image_vector(reader: Reader, node: Any, groups: Groups) -> Operand:
    vector: Operand = reader.get_or(node, "Vector", groups, attributes.layer(attributes.ACTIVE_UV))
    return vector


def _uses_alpha(reader: Reader, node: Any, groups: Groups, vector: Operand) -> bool:
    """Whether the alpha of a node is linked, or that of an equal node, which Cycles merges with it."""
    if node.outputs["Alpha"].links:
        return True
    settings = ("image", "interpolation", "extension", "projection", "projection_blend")
    for other in node.id_data.nodes:
        if (other.type != "TEX_IMAGE" or other == node or other.mute or not other.outputs["Alpha"].links
                or any(getattr(other, name) != getattr(node, name) for name in settings)):  # fmt: skip
            continue
        try:
            if _image_vector(reader, other, groups) == vector:
                return True
        except Unreadable:  # as the vector of `node` would be
            continue
    return False


@reads("TEX_ENVIRONMENT")
def _environment(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    if _missing(reader, node, groups):
        return MISSING
    codes = reader.codes and _interpolates_codes(reader, node)
    name = read_image(reader, node, groups, codes)
    value = e.ImageTexture(name, reader.get_or(node, "Vector", groups, e.Coordinates("POSITION")),
                           INTERPOLATIONS[node.interpolation], "REPEAT", node.projection,
                           alpha_mode(node.image, False))  # fmt: skip
    return e.Curves(value, FROM_CODES) if codes else value


def _place(reader: Reader, node: Any, groups: Groups) -> Operand:
    """Translate the vector of a procedural texture; generated coordinates if nothing is linked.

    Blender evaluates a texture whose inputs are all constant, where the vector of a group counts with its value.
    """
    socket = by_identifier(node.inputs, "Vector")
    if not is_implicit(socket, feed(socket, groups)) or (INLINES and is_computed_by_blender(node, groups)):
        return reader.value(socket, groups)
    return attributes.layer(attributes.GENERATED)


@reads("TEX_CHECKER")
def _checker(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    place, scale = _place(reader, node, groups), reader.get(node, "Scale", groups)
    if output.identifier == "Fac":
        return p.Checker(place, 1.0, 0.0, scale)
    return p.Checker(place, reader.get(node, "Color1", groups), reader.get(node, "Color2", groups), scale)


@reads("TEX_GRADIENT")
def _gradient(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    return p.Gradient(_place(reader, node, groups), node.gradient_type)


@reads("TEX_WHITE_NOISE")
def _white_noise(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    return p.WhiteNoise(reader.get(node, "Vector", groups), reader.get(node, "W", groups), node.noise_dimensions,
                        output.identifier.upper())  # fmt: skip


def _inputs(reader: Reader, node: Any, groups: Groups, *names: str) -> dict[str, Any]:
    """Translate inputs, by name of the corresponding field ("Detail Scale" -> "detail_scale")."""
    return {name.lower().replace(" ", "_"): reader.get(node, name, groups) for name in names}


FRACTAL = ("W", "Scale", "Detail", "Roughness", "Lacunarity")


@reads("TEX_NOISE")
def _noise(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    inputs = _inputs(reader, node, groups, *FRACTAL, "Distortion", "Offset", "Gain")
    return p.Noise(_place(reader, node, groups), **inputs, dimensions=node.noise_dimensions, kind=node.noise_type,
                   normalize=node.normalize, output=output.identifier.upper())  # fmt: skip


@reads("TEX_VORONOI")
def _voronoi(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    inputs = _inputs(reader, node, groups, *FRACTAL, "Smoothness", "Exponent", "Randomness")
    return p.Voronoi(_place(reader, node, groups), **inputs, dimensions=node.voronoi_dimensions, feature=node.feature,
                     metric=node.distance, normalize=node.normalize, output=output.identifier.upper())  # fmt: skip


@reads("TEX_WAVE")
def _wave(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    inputs = _inputs(reader, node, groups, "Scale", "Distortion", "Detail", "Detail Scale", "Detail Roughness")
    detail = number(folded(inputs["detail"]))
    if detail is not None and detail <= -1.0 and number(folded(inputs["distortion"])) != 0.0:
        reader.note(f"node '{label(node, groups)}': its detail is taken as 0; with {detail:g}, it has no value in "
                    "Cycles, which shows it black or not at all")  # fmt: skip
        inputs["detail"] = 0.0
    direction = node.bands_direction if node.wave_type == "BANDS" else node.rings_direction
    return p.Wave(_place(reader, node, groups), **inputs, phase=reader.get(node, "Phase Offset", groups),
                  kind=node.wave_type, direction=direction, profile=node.wave_profile)  # fmt: skip


@reads("TEX_MAGIC")
def _magic(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    inputs = _inputs(reader, node, groups, "Scale", "Distortion")
    value = p.Magic(_place(reader, node, groups), **inputs, depth=node.turbulence_depth)
    return e.Average(value) if output.identifier == "Fac" else value


@reads("TEX_BRICK")
def _brick(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    inputs = _inputs(reader, node, groups, "Color1", "Color2", "Mortar", "Scale", "Mortar Size", "Mortar Smooth",
                     "Bias", "Brick Width", "Row Height")  # fmt: skip
    return p.Brick(_place(reader, node, groups), **inputs, offset=node.offset, offset_frequency=node.offset_frequency,
                   squash=node.squash, squash_frequency=node.squash_frequency,
                   output=output.identifier.upper())  # fmt: skip
