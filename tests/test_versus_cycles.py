"""The comparison with Cycles: its statistics, and three of its scenes at few samples."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.benchmarks import agreement


def _noisy(rng: np.random.Generator, picture: np.ndarray, noise: float, seeds: int = 6) -> np.ndarray:
    return (picture + noise * rng.gamma(1.0, 1.0, (seeds, *picture.shape)) - noise).astype(np.float32)


@pytest.fixture
def picture() -> np.ndarray:
    """A soft gradient."""
    y, x = np.mgrid[0:96, 0:128] / 128.0
    return np.stack([0.2 + x, 0.5 + y, 1.0 - 0.5 * x], axis=-1)


def test_equal_expectations_agree_and_deviates_are_normal(picture: np.ndarray) -> None:
    rng = np.random.default_rng(0)
    figures, z = agreement.compare(_noisy(rng, picture, 0.3), _noisy(rng, picture, 0.5))
    assert figures.agrees
    assert abs(figures.mean) < 4.0 * figures.mean_error
    assert figures.beyond < 0.01
    assert z.std() == pytest.approx(1.0, abs=0.08)
    assert figures.rmse == pytest.approx(figures.noise, rel=0.1)
    assert figures.pixel_rmse == pytest.approx(figures.pixel_noise, rel=0.05)


def test_a_bias_of_the_whole_is_found(picture: np.ndarray) -> None:
    rng = np.random.default_rng(1)
    figures, _ = agreement.compare(_noisy(rng, 1.015 * picture, 0.3), _noisy(rng, picture, 0.3))
    assert figures.mean == pytest.approx(0.015, abs=4.0 * figures.mean_error)
    assert not figures.agrees


def test_a_difference_in_one_place_is_found_that_leaves_the_mean(picture: np.ndarray) -> None:
    rng = np.random.default_rng(2)
    other = picture.copy()
    other[8:24, 8:40] *= 1.2
    other[40:56, 8:40] *= 0.8
    figures, z = agreement.compare(_noisy(rng, other, 0.1), _noisy(rng, picture, 0.1))
    assert abs(figures.mean) < agreement.MEAN_LIMIT
    assert figures.beyond > agreement.BEYOND_LIMIT
    assert figures.excess > agreement.EXCESS_LIMIT
    assert not figures.agrees
    assert np.abs(z[1:3, 1:5]).min() > 3.0


def test_pictures_of_different_sizes_and_single_seeds_are_refused(picture: np.ndarray) -> None:
    seeds = np.stack([picture] * 2).astype(np.float32)
    with pytest.raises(ValueError, match="different sizes"):
        agreement.compare(seeds, seeds[:, :-1])
    with pytest.raises(ValueError, match="one seed"):
        agreement.compare(seeds[:1], seeds)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["diffuse", "orthographic", "specular"])
def test_scene_agrees_with_cycles(name: str, tmp_path: Path) -> None:
    pytest.importorskip("bpy", reason="Blender's Python module isn't installed")
    from tests.benchmarks import versus_cycles
    from tests.benchmarks.cycles_scenes import CASES

    row = versus_cycles.compare(CASES[name], tmp_path, samples=16, seeds=4)
    assert row.error == ""
    assert row.verdict == "agrees", versus_cycles.line(row)
    assert (tmp_path / f"{name}.png").stat().st_size > 1000


def test_a_known_difference_counts_only_if_the_export_names_it() -> None:
    pytest.importorskip("bpy", reason="Blender's Python module isn't installed")
    from tests.benchmarks import versus_cycles

    apart = agreement.Agreement(0.1, 0.001, 0.5, 0.2, 0.001, 0.2, 0.01, 0.01, 0.01)

    def verdict(differs: tuple[str, ...], notes: list[str]) -> str:
        row = versus_cycles.Row("a", "A scene", "lamps", 1, 1, 1.0, figures=apart, differs=differs, notes=notes)
        return row.verdict

    assert verdict((), ["light 'A': is left out"]) == "differs"
    assert verdict(("it is left out",), []) == "differs"
    assert verdict(("it is left out",), ["light 'A': is left out"]) == "named"


def test_scenes_are_counted_by_feature() -> None:
    pytest.importorskip("bpy", reason="Blender's Python module isn't installed")
    from tests.benchmarks import versus_cycles
    from tests.benchmarks.cycles_scenes import CASES

    assert CASES["gltf_alpha"].feature == "as found: gltf" and CASES["ies_lamp"].feature == "lamp settings"
    rows = [versus_cycles.Row(name, "", feature, 1, 1, 1.0) for name, feature in (("a", "x"), ("b", "y"), ("c", "x"))]
    assert versus_cycles.by_feature(rows)[2:] == ["| x | 2 |  |  |  | 2 |", "| y | 1 |  |  |  | 1 |",
                                                  "| **all** | 3 |  |  |  | 3 |"]  # fmt: skip


def test_pictures_are_kept_if_a_rewritten_script_builds_the_same_scene(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")
    from tests.benchmarks import cycles_peer, versus_cycles
    from tests.benchmarks.cycles_scenes import CASES, stage

    rendered = []

    def picture(folder: Path, seeds: int) -> tuple[Any, float]:
        rendered.append(folder)
        return np.full((seeds, 2, 2, 3), float(len(rendered)), np.float32), 1.0

    monkeypatch.setattr(cycles_peer, "render", picture)
    case = CASES["specular"]

    def made(source: str, also: Any = None) -> float:
        def build() -> None:
            case.build()
            if also is not None:
                also()

        rewritten = replace(case, build=build, source=source)
        return float(versus_cycles.by_cycles(rewritten, tmp_path, 4, 2)[0].max())

    assert made("first") == 1.0 and made("second") == 1.0
    stage.empty()
    case.build()
    ball = next(ob.name for ob in bpy.data.objects if ob.type == "MESH")
    assert made("third", lambda: setattr(bpy.data.objects[ball].location, "x", 0.3)) == 2.0
    assert made("fourth") == 3.0


def test_rows_of_a_report_are_read_back(tmp_path: Path) -> None:
    pytest.importorskip("bpy", reason="Blender's Python module isn't installed")
    from tests.benchmarks import versus_cycles

    figures = agreement.Agreement(0.1, 0.001, 0.5, 0.2, 0.001, 0.2, 0.01, 0.01, 0.01)
    rows = [versus_cycles.Row("a", "A", "lamps", 1, 1, 1.0, figures=figures, differs=("why",), notes=["what"]),
            versus_cycles.Row("b", "B", "lamps", 1, 1, 1.0, error="none")]  # fmt: skip
    file = tmp_path / "report.json"
    assert versus_cycles.read_rows(file) == {}
    file.write_text(json.dumps({"rows": [asdict(row) | {"verdict": row.verdict} for row in rows]}))
    assert list(versus_cycles.read_rows(file).values()) == rows
