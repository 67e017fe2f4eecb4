"""Benchmarks run: they follow the interfaces that they measure. What they print is not looked at."""

from __future__ import annotations

import pytest

from tests.benchmarks import case_noise, contact_noise, gloss_noise, scaling, scenes, throughput
from tests.support.scenes import mirrored_shadows


@pytest.mark.parametrize("kind", scaling.SIZES)
def test_scaling_is_measured(kind: str) -> None:
    # Textures of 1024² texels are the smallest of their kind.
    found = scaling.measure(kind, 1024**2 if kind == "texels" else 12)
    assert set(scaling.STEPS) <= set(found)


def test_rays_and_updates_are_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(throughput, "RUNS", 1)
    monkeypatch.setattr(throughput, "RAYS", 64)
    report = throughput.Report({}, tiny=throughput.measure_tiny(1, 12), updates=[throughput.measure_update(1, 4)])
    vertices, faces = throughput.tiny_mesh(36)
    traced = throughput.ray_scene(vertices, faces, 1)
    pose = scenes.neutral("cornell_box")["camera"]["to_world"]
    report.rates = [throughput.measure_rates(traced, len(faces), rays)
                    for rays in throughput.make_rays(traced, vertices, faces, pose)]
    assert throughput.markdown(report).count("shadow") == 2


def test_noise_is_measured() -> None:
    assert gloss_noise.measure(["image"], ["none"], ["metal"], ["all"], 1, 2, "ball")
    assert contact_noise.measure("chair", 3, [1], 2)
    make, paths, options = case_noise.parts(next(iter(mirrored_shadows.CASES.values())), 4)
    assert len(case_noise.measure(make, paths, 1, 2, **options)) == len(case_noise.COLUMNS)
