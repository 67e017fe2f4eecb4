"""Derivatives of the shading code by itself: against differences, and forward against backward sweeps."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from edgegrad import Image, Mesh, _native
from edgegrad import expression as e
from edgegrad.expression import procedural as t
from edgegrad.scene.material import KINDS
from edgegrad.tables.materials import (
    ANISOTROPIC,
    BECKMANN,
    COLUMNS,
    DIFFUSE,
    EMISSION,
    GLOSSY,
    MULTISCATTER,
    PHONG,
    REFRACTION,
    THIN_FILM,
    WIDTH,
)
from edgegrad.tables.textures.program import compile_textures
from edgegrad.tables.textures.texture_tables import TextureTables
from tests.support import node_cases
from tests.support.differences import INTERMEDIATE, check_derivative
from tests.support.node_cases.texture_points import Points, points, scene_of
from tests.support.scene_probe import DOT_PRODUCT, units

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]


def random_rows(rng: np.random.Generator, n: int) -> F32:
    """Values of materials within their ranges, and off the places where a formula changes."""
    rows = rng.uniform(0.15, 0.85, (n, WIDTH)).astype(np.float32)

    def put(field: str, low: float, high: float) -> None:
        place, count = COLUMNS[field]
        rows[:, place : place + count] = rng.uniform(low, high, (n, count))

    put("roughness", 0.35, 0.8)
    put("coat_roughness", 0.35, 0.8)
    put("sheen_roughness", 0.3, 0.8)
    put("ior", 1.2, 1.9)
    put("coat_ior", 1.2, 1.9)
    put("anisotropy", 0.2, 0.7)
    put("thin_film_thickness", 150.0, 600.0)
    put("thin_film_ior", 1.2, 1.9)
    return rows


def random_points(rng: np.random.Generator, n: int, below: bool) -> SimpleNamespace:
    """Random points with a material each; light comes from `below` the surface or from above."""
    up = np.tile(np.array([0.0, 0.0, 1.0], np.float32), (n, 1))
    tilt = 0.05 * rng.normal(size=(n, 3)).astype(np.float32)
    wi = units(rng, n)
    if below:
        wi = -wi
    return SimpleNamespace(
        material=np.arange(n, dtype=np.int32), from_inside=rng.integers(0, 2, n).astype(np.int32), wo=units(rng, n),
        wi=wi, normal=up + tilt, true_normal=up, tangent=units(rng, n, upper=False),
        random=rng.random((3, n), np.float32))  # fmt: skip


def zero_tangents(of: dict[str, Any]) -> SimpleNamespace:
    return SimpleNamespace(**{name: np.zeros(np.size(v)) for name, v in of.items()})


SHADERS = {
    "PRINCIPLED": DIFFUSE | GLOSSY | REFRACTION | EMISSION | MULTISCATTER | ANISOTROPIC,
    "DIFFUSE": DIFFUSE,
    "GLOSSY": GLOSSY | MULTISCATTER | ANISOTROPIC,
    "GLASS": GLOSSY | REFRACTION | MULTISCATTER,
    "REFRACTION": GLOSSY | REFRACTION,
    "TRANSLUCENT": DIFFUSE,
    "SHEEN": GLOSSY,
    "DISNEY": DIFFUSE | GLOSSY,
    "PRINCIPLED FILM": DIFFUSE | GLOSSY | REFRACTION | MULTISCATTER | THIN_FILM,
    "GLASS FILM": GLOSSY | REFRACTION | THIN_FILM,
    "VELVET": GLOSSY,
    "GLOSSY BECKMANN": GLOSSY | ANISOTROPIC | BECKMANN,
    "GLASS BECKMANN": GLOSSY | REFRACTION | BECKMANN,
    "REFRACTION BECKMANN": GLOSSY | REFRACTION | BECKMANN,
    "GLOSSY PHONG": GLOSSY | ANISOTROPIC | PHONG,
}


@pytest.fixture(params=SHADERS)
def shader(request: pytest.FixtureRequest) -> str:
    assert {name.split()[0] for name in SHADERS} | {"TRANSPARENT"} == set(KINDS)
    return str(request.param)


class Bsdfs:
    """Random BSDFs of a kind, with their floats by name."""

    def __init__(self, kind: str, n: int, seed: int, below: bool = False) -> None:
        rng = np.random.default_rng(seed)
        number = KINDS.index(kind.split()[0])
        self.materials = SimpleNamespace(
            kind=np.full(n, number, np.int32), params=random_rows(rng, n), flags=np.full(n, SHADERS[kind], np.int32)
        )
        self.points = random_points(rng, n, below)
        self.isa = _native.instruction_sets()[0]

    def floats(self) -> dict[str, F32]:
        names = ("normal", "true_normal", "tangent", "wo", "wi")
        return {"params": self.materials.params} | {name: getattr(self.points, name) for name in names}

    def along(self, name: str, direction: F64, h: float) -> F64:
        """(n, 6) values and emissions where a table has moved by h times the direction."""
        materials, where = SimpleNamespace(**vars(self.materials)), SimpleNamespace(**vars(self.points))
        holder = materials if name == "params" else where
        setattr(holder, name, (getattr(holder, name) + h * direction).astype(np.float32))
        out = _native.evaluate_bsdfs(materials, where, self.isa)
        return np.concatenate([out["value"], out["emission"]], axis=1).astype(float)

    def forward(self, tangents: SimpleNamespace) -> F64:
        return np.asarray(_native.bsdfs_forward(self.materials, self.points, tangents, self.isa), float)

    def backward(self, adjoint: F32) -> dict[str, F64]:
        return _native.bsdfs_backward(self.materials, self.points, adjoint, self.isa)


@pytest.mark.parametrize("below", [False, True])
def test_bsdfs_against_differences(shader: str, below: bool) -> None:
    if below and shader.split()[0] not in ("PRINCIPLED", "GLASS", "REFRACTION", "TRANSLUCENT"):
        return
    bsdfs = Bsdfs(shader, 400, seed=7, below=below)
    for name, values in bsdfs.floats().items():
        for place in range(values.shape[1]):
            change = np.zeros(values.shape)
            change[:, place] = 1.0
            tangents = zero_tangents(bsdfs.floats())
            setattr(tangents, name, change.ravel())
            found = bsdfs.forward(tangents)
            # Nanometres are small beside the thickness of a film.
            nanometres = name == "params" and place == COLUMNS["thin_film_thickness"][0]
            step = 0.03 if nanometres else 1e-3
            decided = check_derivative(found, partial(bsdfs.along, name, change), step)
            small = np.abs(found).max() < 1e-3 * np.abs(bsdfs.along(name, change, 0.0)).max()
            # At most a tenth of the points: an error in a formula would affect more.
            assert decided > 0.1 or small, (name, place)


@pytest.mark.parametrize("below", [False, True])
def test_bsdf_sweeps_are_transposes(shader: str, below: bool) -> None:
    rng = np.random.default_rng(11)
    bsdfs = Bsdfs(shader, 301, seed=3, below=below)  # no whole number of packets
    tangents = SimpleNamespace(**{name: rng.normal(size=v.size) for name, v in bsdfs.floats().items()})
    adjoint = rng.normal(size=(301, 6)).astype(np.float32)
    gradients = bsdfs.backward(adjoint)
    terms = adjoint * bsdfs.forward(tangents)
    pulled = sum(float(np.sum(gradients[name] * getattr(tangents, name))) for name in gradients)
    assert abs(np.sum(terms) - pulled) <= DOT_PRODUCT * np.sum(np.abs(terms))


def test_instruction_sets_have_the_same_gradients(shader: str) -> None:
    bsdfs = Bsdfs(shader, 100, seed=5)
    adjoint = np.random.default_rng(0).normal(size=(100, 6)).astype(np.float32)
    reference = bsdfs.backward(adjoint)
    for bsdfs.isa in _native.instruction_sets():
        for name, gradient in bsdfs.backward(adjoint).items():
            assert gradient == pytest.approx(reference[name], rel=1e-3, abs=1e-4 * np.abs(reference[name]).max())


# ---- Textures ----

TEXTURE_FLOATS = ("b1", "b2", "position", "normal", "true_normal", "view")
TABLE_FLOATS = ("pixels", "constants", "lookups", "attributes")


class Textures:
    """Expressions of the attributes "P" and "Q" at random points, with all floats they depend on by name."""

    def __init__(self, expressions: list[e.Expression], n: int, seed: int,
                 images: dict[str, Image] | None = None) -> None:  # fmt: skip
        rng = np.random.default_rng(seed)
        corners = np.arange(3 * n, dtype=np.int32).reshape(n, 3)
        mesh = Mesh(rng.normal(size=(3 * n, 3)), corners, ("m0",), attributes={
            name: (rng.uniform(low, high, (n, 1, 3)) + 0.02 * rng.normal(size=(n, 3, 3))).astype(np.float32)
            for name, low, high in (("P", -1.5, 1.5), ("Q", 0.1, 0.9))})  # fmt: skip
        self.tables = compile_textures(scene_of(expressions, {"mesh": mesh}, images))
        self.points = points(n, face=np.arange(n), b1=rng.uniform(0.1, 0.4, n), b2=rng.uniform(0.1, 0.4, n),
                             position=rng.normal(size=(n, 3)), normal=units(rng, n), true_normal=units(rng, n),
                             view=units(rng, n))  # fmt: skip
        self.isa = _native.instruction_sets()[0]

    def floats(self) -> dict[str, F32]:
        return {name: getattr(self.points, name) for name in TEXTURE_FLOATS} | {
            name: getattr(self.tables, name) for name in TABLE_FLOATS
        }

    def changed(self, tangents: SimpleNamespace, h: float) -> tuple[TextureTables, Points]:
        tables, where = SimpleNamespace(**vars(self.tables)), SimpleNamespace(**vars(self.points))
        for names, holder in ((TEXTURE_FLOATS, where), (TABLE_FLOATS, tables)):
            for name in names:
                v = getattr(holder, name)
                setattr(holder, name, (v + h * getattr(tangents, name).reshape(v.shape)).astype(np.float32))
        return tables, where  # type: ignore[return-value]

    def along(self, program: int, tangents: SimpleNamespace, h: float) -> F64:
        tables, where = self.changed(tangents, h)
        where.program = np.full(len(where.face), program, np.int32)
        rows = np.zeros((len(where.face), WIDTH), np.float32)
        _native.evaluate_textures(tables, where, rows, self.isa)
        return rows.astype(float)

    def forward(self, program: int, tangents: SimpleNamespace) -> F64:
        self.points.program[:] = program
        return np.asarray(_native.textures_forward(self.tables, self.points, tangents, self.isa), float)

    def backward(self, program: int, adjoint: F32) -> dict[str, F64]:
        self.points.program[:] = program
        return _native.textures_backward(self.tables, self.points, adjoint, self.isa)

    def check(self, program: int, step: float, names: Iterable[str], intermediate: float = INTERMEDIATE,
              repeats: float = 0.0) -> list[float]:  # fmt: skip
        """Both sweeps of a program for random directions of all tables, and differences for those named."""
        rng = np.random.default_rng(program)
        adjoint = np.zeros((len(self.points.face), WIDTH), np.float32)
        adjoint[:, :8] = rng.normal(size=(len(adjoint), 8))
        gradients = self.backward(program, adjoint)
        decided = []
        for name, values in self.floats().items():
            if values.size == 0:
                continue
            tangents = zero_tangents(self.floats())
            setattr(tangents, name, rng.choice([-1.0, 1.0], values.size))
            found = self.forward(program, tangents)
            terms, pulled = adjoint * found, gradients[name] * getattr(tangents, name)
            size = np.sum(np.abs(terms)) + np.sum(np.abs(pulled))
            assert abs(np.sum(terms) - np.sum(pulled)) <= DOT_PRODUCT * size, name
            if name in names:
                share = check_derivative(found, partial(self.along, program, tangents), step, intermediate, repeats)
                decided.append(share)
        return decided


# Constants of most nodes are limits and switches, where differences see kinks.
VARIABLES = (*TEXTURE_FLOATS, "pixels", "lookups", "attributes")
# Their period is an operand, or the difference of two, and below the step for one point in some fifty.
SAWTOOTHS = ("WRAP", "MODULO")


@pytest.mark.parametrize(
    "group", ["inputs", "shading", "math", "vector_math", "mapping", "mix", "colors", "ranges", "textures"]
)
def test_nodes(group: str) -> None:
    cases = getattr(node_cases, group)()
    textures = Textures([expression for _, expression in cases.values()], 96, seed=2)
    # Noise is looked up at coordinates of some hundreds, which have few digits left; cells have many edges.
    step, intermediate = (2e-3, 1000.0) if group == "textures" else (1e-3, INTERMEDIATE)
    decided: list[float] = []
    for k, name in enumerate(cases):
        try:
            # White noise and stairs finer than a step have a derivative of zero, and a difference of anything.
            names = () if name.startswith("white noise") or "STEPPED" in name else VARIABLES
            decided += textures.check(int(textures.tables.closure_program[k]), step, names, intermediate,
                                      0.03 if name.endswith(SAWTOOTHS) else 0.0)
        except AssertionError as error:
            raise AssertionError(name) from error
    assert np.mean(np.array(decided) > 0.5) > 0.75


CONSTANTS = {
    "math": e.Math("MULTIPLY_ADD", e.Attribute("P"), 1.7, 0.4),
    "mapping": e.Transform(e.Attribute("P"), ((1.5, 0.2, 0.1, 0.3), (0.7, -0.4, 0.6, 0.2), (0.3, 0.9, 1.1, -0.7))),
    "mix": e.Mix(0.3, e.Attribute("P"), (0.2, 0.4, 0.7), "SCREEN"),
    "noise": t.Noise(e.Attribute("P"), scale=3.3, detail=2.4, roughness=0.6, lacunarity=2.1, distortion=0.4),
    "voronoi": t.Voronoi(e.Attribute("P"), scale=2.6, detail=1.4, roughness=0.6, lacunarity=2.1, randomness=0.8),
}


@pytest.mark.parametrize("name", CONSTANTS)
def test_constants_of_nodes(name: str) -> None:
    textures = Textures([CONSTANTS[name]], 256, seed=8)
    assert textures.check(0, 2e-4 if name == "noise" else 1e-3, ["constants"])[0] > 0.5


@pytest.mark.parametrize("interpolation", e.INTERPOLATIONS)
@pytest.mark.parametrize("extension", e.EXTENSIONS)
def test_images(interpolation: str, extension: str) -> None:
    rng = np.random.default_rng(4)
    for channels, alpha in ((1, "NONE"), (3, "NONE"), (4, "STRAIGHT"), (4, "CHANNEL_PACKED")):
        pixels = rng.uniform(0.1, 1.0, (5, 6, channels)).astype(np.float32)
        node = e.ImageTexture("image", e.Attribute("P"), interpolation, extension, alpha=alpha)
        textures = Textures([node], 128, seed=5, images={"image": Image(pixels)})
        assert textures.check(0, 1e-3, ["pixels"])[0] > 0.8
        moved = textures.check(0, 1e-3, ["attributes"])[0]
        assert moved > 0.5 or interpolation == "CLOSEST"
