"""Places of columns are written once in Python and once in C++: both say the same."""

from __future__ import annotations

import re
from pathlib import Path

from edgegrad.scene.material import KINDS
from edgegrad.tables import camera, lights, materials

NATIVE = Path(__file__).parents[2] / "native" / "scene"


def constants(header: str, enumeration: str) -> dict[str, int]:
    """Names and values of a C++ enumeration whose values are written out, or count from 0."""
    text = re.sub(r"//[^\n]*", "", (NATIVE / header).read_text())
    body = re.search(rf"enum {enumeration}\b[^{{]*{{([^}}]*)}}", text)
    assert body is not None, enumeration
    out: dict[str, int] = {}
    for item in filter(None, (part.strip() for part in body[1].split(","))):
        name, _, value = (part.strip() for part in item.partition("="))
        out[name] = eval(value) if value else len(out)
    return out


def snake(name: str, prefix: str) -> str:
    return re.sub(r"(?<=.)([A-Z])", r"_\1", name.removeprefix(prefix)).lower()


def test_materials() -> None:
    found = constants("material_params.h", "MaterialParam")
    assert found.pop("kMaterialParams") == materials.WIDTH
    places = {"normal" if name == "kNormalMap" else snake(name, "k"): place for name, place in found.items()}
    assert places == {field: place for field, (place, _) in materials.COLUMNS.items()}
    kinds = {snake(name, "k").upper(): number for name, number in constants("material_params.h", "ShaderKind").items()}
    assert kinds == {kind: number for number, kind in enumerate(KINDS)}


def test_flags_of_materials() -> None:
    names = {"kHasDiffuse": "DIFFUSE", "kHasGlossy": "GLOSSY", "kHasTransparency": "TRANSPARENCY",
             "kHasEmission": "EMISSION", "kHasNormalMap": "NORMAL_MAP", "kMultiscatter": "MULTISCATTER",
             "kEmissionTwoSided": "TWO_SIDED", "kHasRefraction": "REFRACTION", "kLambertian": "LAMBERTIAN",
             "kAnisotropic": "ANISOTROPIC", "kBeckmann": "BECKMANN", "kPhong": "PHONG",
             "kNormalInWorld": "NORMAL_IN_WORLD", "kHasAbsorption": "ABSORPTION",
             "kThinFilm": "THIN_FILM", "kNormalBelow": "NORMAL_BELOW"}  # fmt: skip
    found = constants("material_params.h", "ClosureFlag")
    assert {name: getattr(materials, word) for name, word in names.items() if name in found} == found


def test_lights() -> None:
    found = constants("lights/light_params.h", "LightParam")
    assert found.pop("kLightParams") == lights.WIDTH
    words = {"kLightDirection": "SHINES_TO"}
    for name, place in found.items():
        column = getattr(lights, words.get(name, snake(name, "kLight").upper()))
        assert (column.start if isinstance(column, slice) else column) == place, name
    kinds = constants("lights/light_params.h", "LightKind")
    python = ("POINT", "SPHERE", "DISK", "RECTANGLE", "ELLIPSE", "DIRECTION", "CONE")
    assert [getattr(lights, kind) for kind in python] == list(kinds.values())[1:]
    flags = constants("lights/light_params.h", "LightFlag")
    assert list(flags.values()) == [lights.SMOOTH_CONE, lights.LINEAR_CONE, lights.SPREAD, lights.CASTS_SHADOW,
                                    lights.DECAYS, lights.BY_WAY, lights.BY_WAY2, lights.STRETCHED]


def test_camera() -> None:
    found = constants("camera_row.h", "CameraFloat")
    starts = {place.start for place in camera.PLACES.values()}
    assert starts <= set(found.values())
    words = {"kCameraPosition": "camera_position", "kCameraRight": "camera_axes", "kCameraPrincipal": "principal_point"}
    axes = camera.PLACES["camera_axes"].start
    for name, place in found.items():
        if name in ("kCameraUp", "kCameraBack"):
            assert place in (axes + 3, axes + 6)
        else:
            assert camera.PLACES[words.get(name, snake(name, "kCamera"))].start == place, name
