"""Export of hair: particle systems that are rendered as paths, and CURVES objects, as meshes of prisms."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edgegrad import Camera
from edgegrad.geometry.camera_view import depths, pixel_widths
from edgegrad.images import srgb_to_linear
from edgegrad.scene.camera import PANORAMAS
from edgegrad.scene.placement import stretches

from ...problem import Report
from .attributes import (
    ACTIVE_UV,
    GENERATED,
    INTERCEPT,
    IS_STRAND,
    LENGTH,
    OBJECT,
    OBJECT_NORMAL,
    RANDOM_STRAND,
    THICKNESS,
    ObjectValues,
    is_of_object,
)
from .hashes import hash_words
from .layers import layer_values
from .mesh import MeshArrays
from .normals import shading_normals
from .strands import FEWEST_SIDES, RIBBON, Strands, lengths, prisms, resampled, sides_for, straight, triangles, usable

F64 = NDArray[np.float64]
Built = tuple[MeshArrays, dict[str, NDArray[np.float32]]]  # a mesh and its attributes

# Triangles of all hair of a scene; more strands than they suffice for are thinned out.
MOST_TRIANGLES = 6_000_000
COARSE = 0.5  # pixels by which strands may be displaced before they are thinned out
CURVES_RADIUS = 0.005  # of curves without radii in Cycles
# Values of the Hair Info node that a strand itself has.
OWN = (IS_STRAND, INTERCEPT, LENGTH, THICKNESS, RANDOM_STRAND)


@dataclass(frozen=True)
class Hair:
    """The hair of one object: a particle system, or the curves of a CURVES object.

    Attributes
    ----------
    object
        The evaluated object.
    modifier
        Of the particle system; None: the object has curves.
    number
        Of strands.
    """

    object: Any
    modifier: Any
    number: int

    @property
    def label(self) -> str:
        """The name in warnings."""
        kind = f", particle system '{self.modifier.particle_system.name}'" if self.modifier is not None else ""
        return f"object '{self.object.original.name}'{kind}"

    @property
    def part(self) -> str:
        """Its name within the object."""
        return f"hair {self.modifier.particle_system.name}" if self.modifier is not None else ""

    def slot(self, count: int) -> int:
        """Material slot of an object with `count` slots. Cycles gives all curves of a CURVES object the first."""
        return 0 if self.modifier is None else int(
            np.clip(self.modifier.particle_system.settings.material - 1, 0, count - 1))  # fmt: skip


def hair_of(ob: Any, report: Report) -> Iterator[Hair]:
    """Yield the hair of an object that was evaluated for a render."""
    if ob.type == "CURVES":
        if len(ob.data.curves):
            yield Hair(ob, None, len(ob.data.curves))
        return
    if ob.type != "MESH" or not ob.particle_systems:
        return
    for modifier in ob.modifiers:
        if modifier.type != "PARTICLE_SYSTEM" or not modifier.show_render:
            continue
        system, settings = modifier.particle_system, modifier.particle_system.settings
        if settings.type != "HAIR" or settings.render_type != "PATH":
            continue
        found = Hair(ob, modifier, len(_numbers(system)))
        if ob.original.mode in ("EDIT", "PARTICLE_EDIT"):
            report.warn(found.label, "its hair is left out, as in Cycles, while the object is being edited")
            continue
        yield found


def _numbers(system: Any) -> range:
    """Numbers of the strands that are rendered: children hide their parents."""
    parents, children = len(system.particles), len(system.child_particles)
    hidden = parents if system.settings.child_type != "NONE" and children else 0
    return range(hidden, parents + children)


# Ribbons are visibly not tubes if strands are wider than this in pixels, or wider than this and thick for their length.
WIDE, NOT_NARROW, THICK = 4.0, 0.25, 0.1


@dataclass
class HairMeshes:
    """Turns hair into meshes.

    Attributes
    ----------
    camera
        Decides how finely strands are tessellated.
    linear
        Whether Cycles draws all strands as straight tubes between their points.
    strands
        Number of all strands of the scene, which share the triangles that memory allows.
    ribbons
        Whether Cycles draws strands as ribbons that have the normals of tubes.
    """

    camera: Camera
    linear: bool
    report: Report
    strands: int
    ribbons: bool = False

    def build(self, hair: Hair, values: ObjectValues, names: set[str], translucent: bool) -> Built | None:
        """Return the mesh of some hair, and its attributes of these names; None: no strand can be seen.

        Parameters
        ----------
        translucent
            Whether its material lets light through.
        """
        strands = self._read(hair, names)
        strands = usable(strands)
        if not len(strands.points):
            self.report.warn(hair.label, "has no hair that can be seen; it is left out")
            return None
        linear = np.asarray(values.matrix[:3, :3], np.float64)
        if abs(np.linalg.det(linear)) < 1e-30:
            self.report.warn(hair.label, "is scaled to nothing; its hair is left out")
            return None
        pixel = pixel_size(self.camera, strands.points @ linear.T + values.matrix[:3, 3])
        scale = abs(float(np.linalg.det(linear))) ** (1.0 / 3.0)
        along, total = lengths(strands)
        share = along / total[strands.of_point()]
        # Cycles scales radii like the object, unless the object's scale is non-uniform.
        thickness = 2.0 * strands.radius * (1.0 if stretches(linear) else scale)
        strands.along |= {INTERCEPT: share[:, None], THICKNESS: thickness[:, None]}
        strands.each[LENGTH] = total[:, None]
        width = 2.0 * scale * float(np.quantile(strands.radius, 0.9)) / pixel
        sides, smooth = sides_for(width, translucent)
        thick = float(np.median(np.maximum.reduceat(thickness, strands.first[:-1]) / total)) > THICK
        if self.ribbons and (width > WIDE or (width > NOT_NARROW and thick)):
            self.report.warn(hair.label, f"its strands, {width:.2g} pixels wide, are tubes; Cycles' ribbons lie in the "
                             "middle of the tubes, so that shadows and reflections near them start "
                             "elsewhere")  # fmt: skip
        if translucent and sides != RIBBON:
            self.report.warn(hair.label, "light that passes through its wide strands meets their surface twice, not "
                             "once as in Cycles")  # fmt: skip
        if self.linear:
            strands.smooth = False
        if smooth and not strands.smooth:
            strands = straight(strands)
        strands, sides, smooth = self._limited(hair, strands, sides, smooth, pixel / scale)
        arrays, point = prisms(strands, sides, smooth)
        return arrays, _attributes(strands, arrays, point, names, values)

    def _limited(self, hair: Hair, strands: Strands, sides: int, smooth: bool,
                 pixel: float) -> tuple[Strands, int, bool]:  # fmt: skip
        """Tessellate strands; reduce sides, sections, and then strands to the triangles that this hair may have."""
        allowed = MOST_TRIANGLES * hair.number / self.strands
        fine = resampled(strands, pixel, wide=smooth)
        if triangles(fine, sides) <= allowed:
            return fine, sides, smooth
        sides, smooth = min(sides, FEWEST_SIDES), False
        if triangles(fine, sides) > allowed:
            fine = resampled(strands, pixel, COARSE)
        strands, share = fine, allowed / triangles(fine, sides)
        if share >= 1.0:
            return strands, sides, smooth
        order = np.arange(len(strands.counts))
        kept = np.floor((order + 1) * share) > np.floor(order * share)
        thinned = strands.select(kept)
        thinned.radius = thinned.radius / share
        self.report.warn(hair.label, f"only {int(kept.sum())} of its {len(kept)} strands are rendered, each "
                         f"{1.0 / share:.2g} times as thick, since all hair of the scene may have "
                         f"{MOST_TRIANGLES} triangles")  # fmt: skip
        return thinned, sides, smooth

    def _read(self, hair: Hair, names: set[str]) -> Strands:
        strands = _curves(hair.object.data, names) if hair.modifier is None else self._particles(hair, names)
        count = len(strands.counts)
        strands.each[RANDOM_STRAND] = (hash_words(np.arange(count), 0) / 0xFFFFFFFF)[:, None]
        return strands

    def _particles(self, hair: Hair, names: set[str]) -> Strands:
        """Read a particle system, in the space of its object."""
        ob, modifier = hair.object, hair.modifier
        system, settings = modifier.particle_system, modifier.particle_system.settings
        numbers = _numbers(system)
        keys = 2**settings.render_step + 1
        if settings.kink == "SPIRAL":
            keys += settings.kink_extra_steps
        read = system.co_hair
        flat = np.fromiter(chain.from_iterable(read(ob, particle_no=k, step=s) for k in numbers for s in range(keys)),
                           np.float64, 3 * keys * len(numbers))  # fmt: skip
        world = flat.reshape(-1, keys, 3)
        # Blender answers a question for a key behind the last one of a strand with zeros; Cycles repeats the last.
        for k in range(1, keys):
            missing = ~world[:, k].any(axis=1)
            world[missing, k] = world[missing, k - 1]
        inverse = np.linalg.pinv(np.array(ob.matrix_world, np.float64))
        points = world.reshape(-1, 3) @ inverse[:3, :3].T + inverse[:3, 3]
        strands = Strands(points, np.zeros(len(points)), np.arange(len(numbers) + 1) * keys)
        along, total = lengths(strands)
        share = along / np.maximum(total[strands.of_point()], 1e-30)
        strands.radius = _profile(settings, share)
        if settings.use_close_tip:
            strands.radius[keys - 1 :: keys] = 0.0
        strands.each |= _of_emitter(ob, modifier, numbers, names)
        if GENERATED in names:
            size = 2.0 * np.array(ob.data.texspace_size, np.float64)
            inverse_size = np.where(size != 0.0, 1.0 / np.where(size != 0.0, size, 1.0), 0.0)
            middle = np.array(ob.data.texspace_location, np.float64)
            strands.each[GENERATED] = (strands.points[::keys] - middle) * inverse_size + 0.5
        return strands


def _profile(settings: Any, share: F64) -> F64:
    """Radius at this share of a strand's length: Blender's "Strand Shape"."""
    left = 1.0 - np.clip(share, 0.0, 1.0)
    shape = settings.shape
    if shape < 0.0:
        left = left ** (1.0 + shape)
    elif shape > 0.0:
        left = left ** (1.0 / max(1.0 - shape, 1e-6))
    scale = 0.5 * settings.radius_scale
    return np.asarray(scale * (left * (settings.root_radius - settings.tip_radius) + settings.tip_radius))


def _of_emitter(ob: Any, modifier: Any, numbers: range, names: set[str]) -> dict[str, F64]:
    """Read UV maps and byte colours of the emitter at the roots."""
    system, mesh = modifier.particle_system, ob.data
    particles = system.particles
    found: dict[str, F64] = {}
    if not len(particles):
        return found

    def particle(k: int) -> Any:
        return particles[min(k, len(particles) - 1)]

    for index, layer in enumerate(mesh.uv_layers):
        wanted = {layer.name, ACTIVE_UV} & names if layer.active_render else {layer.name} & names
        if wanted:
            flat = np.fromiter(chain.from_iterable(
                system.uv_on_emitter(modifier, particle=particle(k), particle_no=k, uv_no=index) for k in numbers),
                np.float64, 2 * len(numbers))  # fmt: skip
            found |= dict.fromkeys(wanted, flat.reshape(-1, 2))
    bytes_ = [one.name for one in mesh.attributes if one.data_type == "BYTE_COLOR" and one.domain == "CORNER"]
    for index, name in enumerate(bytes_):
        if name in names:
            flat = np.fromiter(chain.from_iterable(
                system.mcol_on_emitter(modifier, particle=particle(k), particle_no=k, vcol_no=index) for k in numbers),
                np.float64, 3 * len(numbers))  # fmt: skip
            found[name] = srgb_to_linear(np.clip(flat.reshape(-1, 3), 0.0, 1.0))
    return found


def _curves(data: Any, names: set[str]) -> Strands:
    """Read the data of a CURVES object."""
    count = len(data.points)
    points = np.zeros((count, 3), np.float32)
    if count:
        data.attributes["position"].data.foreach_get("vector", points.ravel())
    first = np.zeros(len(data.curves) + 1, np.int32)
    data.curve_offset_data.foreach_get("value", first)
    radius = layer_values(data.attributes.get("radius"))
    types = layer_values(data.attributes.get("curve_type"))
    strands = Strands(points.astype(np.float64), np.full(count, CURVES_RADIUS) if radius is None else radius[:, 0],
                      first.astype(np.int64))  # fmt: skip
    strands.smooth = types is None or not len(types) or types[0, 0] != POLY
    for layer in data.attributes:
        wanted = {layer.name} & names
        if layer.data_type == "FLOAT2" and layer.domain == "CURVE" and ACTIVE_UV not in strands.each:
            wanted |= {ACTIVE_UV} & names
        values = layer_values(layer) if wanted else None
        if values is not None:
            (strands.along if layer.domain == "POINT" else strands.each).update(dict.fromkeys(wanted, values))
    return strands


POLY = 1  # curve type in Blender


def _attributes(strands: Strands, arrays: MeshArrays, point: NDArray[np.int64], names: set[str],
                of: ObjectValues) -> dict[str, NDArray[np.float32]]:  # fmt: skip
    """(m, 3, c) attributes of these names on the mesh of strands; `point` is the strands' point at each vertex."""
    out: dict[str, NDArray[np.float32]] = {}
    corner = point[arrays.faces]
    strand = strands.of_point()[corner]
    for name in names:
        if is_of_object(name):
            value = of.value(name)
            if value is not None:
                out[name] = np.broadcast_to(np.array(value, np.float32), (*corner.shape, len(value)))
        elif name == IS_STRAND:
            out[name] = np.ones((*corner.shape, 1), np.float32)
        elif name == OBJECT:
            out[name] = arrays.positions[arrays.faces]
        elif name in strands.along:
            out[name] = strands.along[name][corner].astype(np.float32)
        elif name in strands.each:
            out[name] = strands.each[name][strand].astype(np.float32)
        elif name == GENERATED:  # Cycles has none for curves
            out[name] = arrays.positions[arrays.faces]
        elif name == OBJECT_NORMAL:
            normals = shading_normals(arrays.positions, arrays.faces, arrays.smoothing, arrays.normals)
            out[name] = normals.astype(np.float32)
    return {name: np.ascontiguousarray(value) for name, value in out.items()}


def pixel_size(camera: Camera, points: F64) -> float:
    """Size in metres of a pixel at the nearest of these points (world space) that is before the camera."""
    if camera.kind in PANORAMAS:
        depth = np.linalg.norm(points - camera.to_world[:3, 3], axis=1)
    else:
        depth = depths(camera, points)
    depth = depth[depth > camera.clip_start]
    return float(pixel_widths(camera, float(depth.min()) if len(depth) else 1.0))
