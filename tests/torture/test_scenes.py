"""A fixed few of the random scenes, and of the comparisons with differences, in a process of their own."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from edgegrad.expression import nodes_of
from edgegrad.rendering.engine import engine_class
from edgegrad.scene import parameters
from tests.support.small_scenes import need
from tests.torture import run
from tests.torture.drawing import feature_comparisons
from tests.torture.drawing.textures import all_nodes
from tests.torture.processes import results
from tests.torture.scenes import case
from tests.torture.tame import CYCLE, PARAMETERS, SHADERS, comparison

SCENES = 206
# Of very many others those in which something was wrong: negative pictures of lamps that some rays alone see and of
# bright metal, a gradient that was no number in glass of an index of exactly 1 whose normals are turned away from the
# view, a plan that left out what covers an emission, a normalised vector whose square no float holds. In the sixth one
# a texture's small number was moved by thousands of times itself, which multiplied the rounding of both modes. Then
# two with fields: one of which a report had no name, and one whose slopes' squares no float holds. In the last one a
# box projection about a normal of length 0 gave negative light.
ONCE_WRONG = (60813, 60860, 102541, 114432, 1005807, 1006327, 5100120, 5101557, 200417)
PATIENCE = 120.0


def test_random_scenes_hold_all_checks() -> None:
    need("native")
    if engine_class("native").narrow:
        pytest.skip("this engine differentiates few tables")
    seeds = [str(seed) for seed in (*range(SCENES), *ONCE_WRONG)]
    found = list(results(seeds, 1, PATIENCE))
    assert len(found) == len(seeds)
    assert [(f["task"], f["wrong"]) for f in found if f["wrong"]] == []


def test_a_continued_run_keeps_its_results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whole lines are kept and their scenes are not done again; a line that was cut off is done again."""
    asked: list[str] = []

    def done(tasks: Iterable[str], workers: int, patience: float) -> Iterator[dict[str, Any]]:
        for task in tasks:
            asked.append(task)
            yield {"task": task, "cpu": 0.0, "kinds": [], "wrong": {}, "told": []}

    monkeypatch.setattr(run, "results", done)
    log = tmp_path / "log.jsonl"
    kept = {"task": "7", "cpu": 0.0, "kinds": [], "wrong": {"hang": "kept"}, "told": []}
    log.write_text(json.dumps(kept) + "\n" + '{"task": "8", "cp')
    monkeypatch.setattr("sys.argv", ["run", "--seed", "6", "--count", "4", "--log", str(log), "--continued"])
    assert run.main() == 1
    assert asked == ["6", "8", "9"]
    assert [found["task"] for found in run.finished(log)] == ["7", "6", "8", "9"]
    assert run.finished(log)[0] == kept


def test_a_scene_is_a_function_of_its_seed() -> None:
    assert repr(case(17)) == repr(case(17))
    assert repr(case(17)) != repr(case(18))


def test_requested_paths_exist_in_the_finished_scene() -> None:
    """In the first scene, an addition replaces the requested numbers of an expression by an expression without any."""
    for seed in (7200949, *range(100)):
        made = case(seed)
        assert made.wrt
        assert set(made.wrt) <= set(parameters.paths(made.scene)), seed


def test_every_node_is_drawn() -> None:
    drawn = {type(node) for seed in range(600) for node in _nodes(seed)}
    assert drawn == set(all_nodes())


def test_every_field_of_every_object_is_drawn_with_several_values() -> None:
    found: dict[str, set[str]] = {}
    for seed in range(300):
        scene = case(seed).scene
        held = [scene.camera, scene.world]
        for collection in parameters.COLLECTIONS:
            held += getattr(scene, collection).values()
        for one in held:
            for f in fields(one):
                value = getattr(one, f.name)
                shown = f"{value.shape} {value.sum()}" if isinstance(value, np.ndarray) else repr(value)
                found.setdefault(f"{type(one).__name__}.{f.name}", set()).add(shown)
    assert {name for name, values in found.items() if len(values) < 2} == {"Material.normal"}  # textures replace it


def test_every_feature_is_drawn_in_valid_scenes() -> None:
    drawn: set[str] = set()
    for seed in range(500):
        made = feature_comparisons.comparison(seed)
        made.scene.validate()
        assert made.path in parameters.paths(made.scene)
        drawn |= set(made.shader.split(", ")[1:])
    assert drawn == set(feature_comparisons.FEATURES)


def test_every_pair_of_shader_and_parameter_is_compared() -> None:
    found = [comparison(seed) for seed in range(len(SHADERS) * len(CYCLE))]
    for parameter in set(PARAMETERS) - {"own"}:
        assert {c.shader for c in found if c.parameter == parameter} == set(SHADERS)
    for shader, (_, own) in SHADERS.items():
        assert set(own) & {c.parameter for c in found if c.shader == shader} or not own


def _nodes(seed: int) -> list[object]:
    materials = case(seed).scene.materials.values()
    return [node for material in materials for texture in material.textures.values() for node in nodes_of(texture)]
