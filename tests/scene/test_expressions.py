"""Expressions: compiled programs against closed forms, and every instruction set against the scalar one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from edgegrad import Image, Material, Mixture, _native
from edgegrad import expression as e
from edgegrad.expression import procedural as t
from edgegrad.tables.materials import COLUMNS, WIDTH
from edgegrad.tables.tables import flatten
from edgegrad.tables.textures.ops import OPCODES
from edgegrad.tables.textures.program import compile_textures
from tests.support import node_cases
from tests.support.node_cases.texture_points import at_values, corners_mesh, evaluate, points, scene_of

P = e.Attribute("P")


def operands(count: int = 257) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    rng = np.random.default_rng(3)
    return rng.uniform(-1.5, 1.5, (count, 3)), rng.uniform(-0.5, 1.5, (count, 3))


def test_operations_have_the_same_numbers_on_both_sides() -> None:
    assert tuple(_native.texture_operations()) == OPCODES


@pytest.mark.parametrize(
    "group", ["inputs", "shading", "math", "vector_math", "mapping", "mix", "colors", "ranges", "textures"]
)
def test_instruction_sets_agree(group: str) -> None:
    cases = [expression for _, expression in getattr(node_cases, group)().values()]
    p, q = operands()
    reference = at_values(cases, p, q, instruction_set="scalar")
    assert np.isfinite(reference).all()
    for name in _native.instruction_sets():
        error = np.abs(at_values(cases, p, q, instruction_set=name) - reference) / np.maximum(1.0, np.abs(reference))
        # Contracted products differ; noise is steep, and its coordinates are some hundreds.
        limit = 2e-4 if group == "textures" else 1e-5
        # Steps lie elsewhere for a few: a coordinate that is rounded to the other side.
        assert np.mean(error > limit) < 1e-4


CLOSED_FORMS: dict[str, tuple[e.Expression, Callable[[Any, Any], Any]]] = {
    "affine": (e.Transform(P, ((2, 0, 0, 1), (0, 0, 3, 0), (1, 1, 1, -2))),
               lambda p, q: np.stack([2 * p[:, 0] + 1, 3 * p[:, 2], p.sum(axis=1) - 2], axis=1)),
    "sine": (e.Math("SINE", e.Math("MULTIPLY", P, 40.0)), lambda p, q: np.sin(40 * p)),
    "arctangent": (e.Math("ARCTAN2", P, e.Attribute("Q")), lambda p, q: np.arctan2(p, q)),
    "power": (e.Math("POWER", e.Math("ABSOLUTE", P), 2.4), lambda p, q: np.abs(p) ** 2.4),
    "logarithm": (e.Math("LOGARITHM", e.Math("ABSOLUTE", P), 10.0), lambda p, q: np.log10(np.abs(p))),
    "tangent": (e.Math("TANGENT", P), lambda p, q: np.tan(p)),
    "hyperbolic tangent": (e.Math("TANH", P), lambda p, q: np.tanh(p)),
    "cross": (e.VectorMath("CROSS_PRODUCT", P, e.Attribute("Q")), np.cross),
    "unit": (e.VectorMath("NORMALIZE", P), lambda p, q: p / np.linalg.norm(p, axis=1, keepdims=True)),
    "unit of a long one": (e.VectorMath("NORMALIZE", e.Math("MULTIPLY", P, 1e17)),
                           lambda p, q: p / np.linalg.norm(p, axis=1, keepdims=True)),
    "unit of one too long": (e.VectorMath("NORMALIZE", e.Math("MULTIPLY", P, 1e25)), lambda p, q: 0.0 * p),
    "checker": (t.Checker(P, scale=1.0),
                lambda p, q: np.repeat(np.floor(p).sum(axis=1) % 2.0, 3).reshape(-1, 3)),
}


@pytest.mark.parametrize("name", CLOSED_FORMS)
def test_closed_forms(name: str) -> None:
    expression, formula = CLOSED_FORMS[name]
    p, q = operands()
    p, q = p.astype(np.float32).astype(float), q.astype(np.float32).astype(float)
    assert at_values([expression], p, q)[0, :, :3] == pytest.approx(formula(p, q), rel=3e-6, abs=3e-6)


@pytest.mark.parametrize("operation", e.MATH_OPERATIONS)
def test_constants_fold_to_what_is_computed(operation: str) -> None:
    for a, b, c in ((0.7, 0.3, 0.2), (-1.3, 2.0, 0.5), (0.0, 0.0, 0.0), (2.5, -0.4, 1.0)):
        folded = compile_textures(scene_of([e.Math(operation, a, b, c)], {"mesh": corners_mesh(P=np.zeros((1, 3)))}))
        assert {OPCODES[op] for op in folded.code[:, 0]} == {"OUTPUT"}
        values = np.array([[a, b, c]])
        computed = e.Math(operation, *(e.Channel(P, k) for k in range(3)))
        pair = at_values([e.Math(operation, a, b, c), computed], values)[:, 0, 0]
        assert pair[0] == pytest.approx(pair[1], rel=1e-6, abs=1e-6)


def test_equal_branches_are_computed_once() -> None:
    node: e.Expression = e.Math("SINE", P)
    for _ in range(60):  # 2^60 leaves as a tree
        node = e.Mix(0.5, node, e.Math("ADD", node, 1.0))
    tables = compile_textures(scene_of([node], {"mesh": corners_mesh(P=np.zeros((1, 3)))}))
    assert len(tables.code) < 1000


def test_what_nobody_reads_is_left_out() -> None:
    wasted = e.Combine(e.Channel(P, 0), t.Noise(P), e.Channel(t.Noise(P, detail=9.0), 1))
    tables = compile_textures(scene_of([e.Channel(wasted, 0)], {"mesh": corners_mesh(P=np.zeros((1, 3)))}))
    assert "NOISE" not in {OPCODES[op] for op in tables.code[:, 0]}


def test_lanes_run_their_own_programs_and_keep_the_rest() -> None:
    count = 100
    rng = np.random.default_rng(0)
    p = rng.uniform(-1.0, 1.0, (count, 3))
    scene = scene_of([P, e.Math("SINE", P), t.Noise(P)], {"mesh": corners_mesh(P=p)})
    where = points(count, face=np.arange(count))
    separate = evaluate(scene, where)
    where.program[:] = rng.integers(-1, 3, count)
    rows = np.full((count, WIDTH), 7.0, np.float32)
    _native.evaluate_textures(compile_textures(scene), where, rows, "")
    emission = COLUMNS["emission"][0]
    for k in range(count):
        if where.program[k] < 0:
            assert np.all(rows[k] == 7.0)
        else:
            assert np.array_equal(rows[k, emission : emission + 3], separate[where.program[k], k, :3])
    untouched = [c for c in range(WIDTH) if not emission <= c < emission + 3 and c != COLUMNS["roughness"][0]]
    assert np.all(rows[:, untouched] == 7.0)


def test_attributes_are_interpolated_between_corners() -> None:
    rng = np.random.default_rng(1)
    mesh = corners_mesh(P=np.zeros((20, 3)))
    mesh.attributes = {f"a{c}": rng.uniform(-1, 1, (20, 3, c)).astype(np.float32) for c in (1, 2, 3, 4)}
    other = corners_mesh(P=np.zeros((5, 3)))
    scene = scene_of([e.Attribute(f"a{c}") for c in (1, 2, 3, 4)], {"other": other, "mesh": mesh})
    face, b1, b2 = rng.integers(0, 25, 200), rng.uniform(0, 0.5, 200), rng.uniform(0, 0.5, 200)
    found = evaluate(scene, points(200, face=face, b1=b1, b2=b2))
    weights = np.stack([1 - b1 - b2, b1, b2], axis=1)
    for k, c in enumerate((1, 2, 3, 4)):
        corners = np.concatenate([np.zeros((5, 3, c)), mesh.attributes[f"a{c}"]])[face]
        mean = np.einsum("nk,nkc->nc", weights, corners)
        missing = face < 5
        if c == 1:
            wanted = np.repeat(mean, 4, axis=1)
        else:
            wanted = np.zeros((200, 4))
            wanted[:, 3] = np.where(missing, 0.0, 1.0)
            wanted[:, :c] = mean
        assert found[k] == pytest.approx(wanted, abs=1e-6)


def numpy_lookup(pixels: NDArray[Any], uv: NDArray[Any], interpolation: str, extension: str) -> NDArray[Any]:
    """(n, c): an image at uv, by the definition of its filter as a sum over pixels."""
    height, width, channels = pixels.shape
    from_below = pixels[::-1].astype(float)
    x, y = uv[:, 0] * width, uv[:, 1] * height

    def spline(d: NDArray[Any]) -> NDArray[Any]:
        a = np.abs(d)
        return np.where(a < 1, (4 - 6 * a**2 + 3 * a**3) / 6, np.where(a < 2, (2 - a) ** 3 / 6, 0.0))

    kernels = {"CLOSEST": lambda d: ((d > -0.5) & (d <= 0.5)).astype(float),
               "LINEAR": lambda d: np.maximum(1 - np.abs(d), 0.0), "CUBIC": spline}
    kernel, reach = kernels[interpolation], 3
    out = np.zeros((len(uv), channels))
    for i in range(-reach, reach + 1):
        for j in range(-reach, reach + 1):
            px, py = np.floor(x).astype(int) + i, np.floor(y).astype(int) + j
            weight = kernel(px + 0.5 - x) * kernel(py + 0.5 - y)
            if extension == "REPEAT":
                px, py = px % width, py % height
            elif extension == "MIRROR":
                px, py = px % (2 * width), py % (2 * height)
                px, py = np.where(px < width, px, 2 * width - 1 - px), np.where(py < height, py, 2 * height - 1 - py)
            elif extension == "CLIP":
                weight = weight * ((px >= 0) & (px < width) & (py >= 0) & (py < height))
            out += weight[:, None] * from_below[np.clip(py, 0, height - 1), np.clip(px, 0, width - 1)]
    return out


@pytest.mark.parametrize("interpolation", e.INTERPOLATIONS)
@pytest.mark.parametrize("extension", e.EXTENSIONS)
def test_image_lookups(interpolation: str, extension: str) -> None:
    rng = np.random.default_rng(2)
    uv = rng.uniform(-2.2, 3.2, (400, 3))
    for shape in ((4, 5, 4), (1, 1, 4), (7, 2, 3), (3, 6, 1)):
        image = rng.uniform(0.0, 1.0, shape).astype(np.float32)
        node = e.ImageTexture("image", P, interpolation, extension, alpha="CHANNEL_PACKED")
        found = at_values([node], uv, images={"image": Image(image)})[0]
        padded = image if shape[2] == 4 else np.concatenate([np.broadcast_to(image, (*shape[:2], 3)),
                                                             np.ones((*shape[:2], 1))], axis=2)
        assert found == pytest.approx(numpy_lookup(padded, uv, interpolation, extension), abs=2e-5)


def test_alpha_modes() -> None:
    rng = np.random.default_rng(4)
    pixels = rng.uniform(0.0, 1.0, (4, 5, 4)).astype(np.float32)
    premultiplied = np.concatenate([pixels[..., :3] * pixels[..., 3:], pixels[..., 3:]], axis=2)
    uv = rng.uniform(0.0, 1.0, (100, 3))
    modes = e.ALPHA_MODES
    found = at_values([e.ImageTexture("i", P, alpha=mode) for mode in modes], uv, images={"i": Image(pixels)})
    of = dict(zip(modes, found, strict=True))
    over = numpy_lookup(premultiplied, uv, "LINEAR", "REPEAT")
    plain = numpy_lookup(pixels, uv, "LINEAR", "REPEAT")
    assert of["PREMULTIPLIED"] == pytest.approx(over, abs=1e-5)
    assert of["STRAIGHT"][:, :3] == pytest.approx(over[:, :3] / over[:, 3:], abs=1e-5)
    assert of["CHANNEL_PACKED"] == pytest.approx(plain, abs=1e-5)
    assert of["NONE"][:, :3] == pytest.approx(plain[:, :3], abs=1e-5)
    assert np.all(of["NONE"][:, 3] == 1.0)


def test_images_are_stored_once_and_opaque_alpha_not_at_all() -> None:
    pixels = np.ones((8, 8, 4), np.float32)
    nodes = [e.ImageTexture("i", P, interpolation) for interpolation in e.INTERPOLATIONS]
    tables = compile_textures(scene_of(nodes, {"mesh": corners_mesh(P=np.zeros((1, 3)))}, {"i": Image(pixels)}))
    assert len(tables.image_offset) == 3
    assert tables.pixels.size == 8 * 8 * 3 + 4


def test_wild_coordinates_read_no_foreign_memory() -> None:
    image = Image(np.full((3, 5, 3), 0.5, np.float32))
    huge = e.Math("EXPONENT", e.Math("MULTIPLY", P, 1e4))
    wild = (huge, e.Math("SUBTRACT", huge, huge), e.Math("MULTIPLY", P, -1e30))
    nodes = [e.ImageTexture("i", v, i, x) for v in wild for i in e.INTERPOLATIONS for x in e.EXTENSIONS]
    nodes += [e.Ramp(e.Channel(v, 0), ((0.5,) * 4, (0.5,) * 4)) for v in wild]
    found = at_values(nodes, np.random.default_rng(0).uniform(-1, 1, (64, 3)), images={"i": image})
    inside = found[..., 0][np.isfinite(found[..., 0])]
    assert np.all((inside >= -1e-6) & (inside <= 0.5001))


def test_position_is_in_the_world_and_rays_are_told_apart() -> None:
    mesh = corners_mesh(P=np.zeros((1, 3)))
    scene = scene_of([e.Coordinates("POSITION"), *(e.LightPath(kind) for kind in e.LIGHT_PATHS)], {"mesh": mesh})
    origin = np.array([10.0, -20.0, 5.0])
    where = points(5, position=np.array([1.0, 2.0, 3.0]), ray_kind=np.arange(5))
    tables = compile_textures(scene, origin)
    rows = np.zeros((5, WIDTH), np.float32)
    first = COLUMNS["emission"][0]
    _native.evaluate_textures(tables, where, rows, "")
    assert rows[0, first : first + 3] == pytest.approx([11.0, -18.0, 8.0])
    for k in range(5):
        where.program[:] = k + 1
        _native.evaluate_textures(tables, where, rows, "")
        assert np.array_equal(rows[:, first], np.arange(5) == k)


def test_weights_of_mixtures_have_programs() -> None:
    scene = scene_of([P], {"mesh": corners_mesh(P=np.zeros((1, 3)))})
    scene.materials = {**scene.materials, "plain": Material(), "mix": Mixture(
        ("plain", "m0"), np.array([0.5, 0.5]), {"1": e.Channel(P, 0)})}
    tables = compile_textures(scene)
    assert tables.closure_program.tolist() == [0, -1, -1, 0]
    assert tables.closure_weight_program.tolist() == [-1, -1, -1, 1]


def test_copies_of_textured_emitters_have_their_attributes() -> None:
    mesh = corners_mesh(P=np.zeros((2, 3)))
    mesh.instances = np.stack([np.eye(4), np.diag([2.0, 2.0, 2.0, 1.0]), np.diag([1.0, 1.0, 3.0, 1.0])])
    tables = flatten(scene_of([P], {"mesh": mesh}))
    assert tables.textures is not None
    assert len(tables.textures.face_mesh) == len(tables.faces) == 6


@pytest.mark.parametrize(
    ("node", "message"),
    [
        (lambda: e.Math("ADD", "x"), "expression Math: operand a must be a number, not 'x'"),  # type: ignore[arg-type]
        (lambda: e.Math("ADD", (1.0, 2.0)), "expression Math: operand a .*not a tuple of 2"),
        (lambda: e.Math("ADD", float("nan")), "expression Math: operand a is not finite"),
        (lambda: e.Ramp(P, ((1.0, 1.0, 1.0, 1.0),)), "material 'm0': textures.*Ramp: table"),
        (lambda: e.Curves(P, ((0.0,) * 3, (1.0,) * 3), minimum=1.0, maximum=0.0),
         "material 'm0': textures.*Curves: maximum"),
        (lambda: e.Transform(P, ((1.0,) * 4,) * 2), "material 'm0': textures.*Transform: matrix"),  # type: ignore[arg-type]
        (lambda: e.Channel(P, 4), "material 'm0': textures.*Channel: index"),
        (lambda: t.Brick(P, offset_frequency=0), "material 'm0': textures.*Brick: offset_frequency"),
    ],
)
def test_wrong_expressions_are_named(node: Callable[[], e.Expression], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        compile_textures(scene_of([node()], {"mesh": corners_mesh(P=np.zeros((1, 3)))}))


def test_wrong_words_are_named() -> None:
    with pytest.raises(ValueError, match="expression Math: operation must be one of"):
        e.Math("FOO", 1.0)
    with pytest.raises(ValueError, match="expression ColorModel"):
        e.ColorModel(P, "HSV", "HSL")
    with pytest.raises(ValueError, match="expression Wave: direction"):
        t.Wave(P, direction="SPHERICAL")


def test_too_many_values_at_once_are_refused() -> None:
    many = [e.Math("SINE", e.Attribute(f"a{k}", required=False)) for k in range(60)]
    total: e.Expression = many[0]
    for node in many[1:]:
        total = e.Math("ADD", total, node)
    product: e.Expression = many[-1]
    for node in many[:-1]:
        product = e.Math("MULTIPLY", product, node)
    scene = scene_of([e.Math("ADD", total, product)], {"mesh": corners_mesh(P=np.zeros((1, 3)))})
    with pytest.raises(ValueError, match="material 'm0': its textures need more than 128 values at once"):
        compile_textures(scene)
