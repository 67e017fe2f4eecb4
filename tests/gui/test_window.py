"""The tab in Blender's window: each way in which a fit ends, and pictures of each state.

    make test-window EXTENSION=dist/edgegrad-0.1.0.zip [WINDOW_DIR=FOLDER] [SHOTS=FOLDER]

Each script of `scripts/` runs once (`conftest.py`); its screenshots are kept in SHOTS.
"""

from __future__ import annotations

from typing import Any

import pytest

pytestmark = pytest.mark.window

UNCHANGED = {
    "escape": (False, "nothing was changed"),
    "undo": (True, "undo or redo"),
    "edit mode": (True, "put into Edit Mode"),
    "open": (True, "another file was opened"),
}
CHANGED = {
    "delete": "object 'Cube' was deleted",
    "rename": "object 'Cube' was renamed to 'Box'",
    "move": "object 'Cube' was moved",
    "new": "another file was opened",
}


@pytest.mark.parametrize("how", UNCHANGED)
def test_what_ends_a_fit_leaves_the_scene_as_it_was(how: str, run: Any) -> None:
    found = run("endings")[0][how]
    failed, words = UNCHANGED[how]
    assert found["same"] and found["failed"] is failed and words in found["said"], found


@pytest.mark.parametrize("how", CHANGED)
def test_a_change_of_its_objects_ends_a_fit(how: str, run: Any) -> None:
    found = run("endings")[0][how]
    assert found["failed"] and CHANGED[how] in found["said"] and found["keys"] == 0, found
    assert how == "new" or found["color"]


@pytest.mark.parametrize("how", ["stop", "stop properties"])
def test_one_undo_restores_every_value(how: str, run: Any) -> None:
    found = run("endings")[0][how]
    assert found["changed"] and found["undone"] and "Loss" in found["said"], found


def test_blender_stays_usable(run: Any) -> None:
    found = run("endings")[0]["usable"]
    assert found == {"selected": [], "saved": True, "waits": True, "second": False, "runs": True}


@pytest.mark.parametrize("what", ["render", "gradient"])
def test_escape_ends_renders(what: str, run: Any) -> None:
    found = run("endings")[0][what]
    assert found["runs"] and found["same"] and "nothing was changed" in found["said"]


def test_disabling_the_addon_ends_a_fit(run: Any) -> None:
    found, log = run("endings")
    assert found["disable"] == {"threads": [], "same": True} and found["enable"]["can start"]
    assert "Traceback" not in log and "Error:" not in log, log


def test_quitting_ends_a_fit(run: Any) -> None:
    found, log = run("quitting")
    assert found["runs"] and "Traceback" not in log


def test_the_way_to_the_first_fit(run: Any) -> None:
    found = run("tour")[0]
    for name, operator in (("no target", "edgegrad.target_open"), ("no picture", "edgegrad.target_open"),
                           ("missing picture", "edgegrad.target_open"), ("other aspect", "edgegrad.match_render"),
                           ("no parameter", "edgegrad.parameters_add"), ("edit mode", "object.mode_set")):  # fmt: skip
        assert found[name][1] == operator, name
    assert found["ready"] == [] and "base colors" in found["set up"].lower()
    assert "Loss" in found["fit"] and found["color"][2] > found["color"][0]
    assert max(found["sensitivities"]) == 1.0 and min(found["sensitivities"]) >= 0.0
    assert "no armature" in found["no armature"] and found["images"] == []
    assert {"idle.png", "target.png", "ready.png", "running.png", "finished.png"} <= set(found["pictures"])


def test_derivatives_are_shown(run: Any) -> None:
    found, log = run("looks")
    assert "Edgegrad Gradient" in found["gradient"] and "agrees" in found["check"] and found["plan lines"] > 5
    assert len(found["colors"]) == 8 and len({tuple(color) for color in found["colors"]}) > 1
    assert found["shown"] == "VERTEX"
    assert all(found[f"{name} refuses"] for name in ("gradient", "check", "plan", "gradient_colors"))
    assert "Traceback" not in log


def test_pixels_of_images_are_fitted(run: Any) -> None:
    found, log = run("textures")
    assert found["rows"] == ["Skin: Pixels"] and found["shown"] and "Traceback" not in log
    assert found["escape"] == {"said": "Fit ended; nothing was changed", "same": True}
    assert "since image 'Skin' was changed" in found["painted"]["said"] and found["painted"]["kept"]
    for name in ("of a file", "of memory"):
        one = found[name]
        assert "Loss" in one["said"] and not one["failed"] and one["packed"], found
        assert one["changed"] and one["undone"] and one["redone"], found


def test_a_fit_as_field_writes_a_mesh(run: Any) -> None:
    found = run("fields")[0]
    assert "Loss" in found["fit"]["said"] and not found["fit"]["failed"], found
    (made,) = found["fit"]["made"]
    assert min(found["fit"]["faces"]) > 100 and found["fit"]["hidden"]["Cube"] and not found["fit"]["hidden"][made]
    assert found["undone"] and found["escape"] == {"said": "Fit ended; nothing was changed", "same": True}


def test_escape_at_any_moment_leaves_the_scene_as_it_was(run: Any) -> None:
    assert run("several")[0]["escapes"] == {"same": True, "said": ["Fit ended; nothing was changed"]}


def test_another_window_leaves_a_fit_alone(run: Any) -> None:
    found = run("several")[0]["windows"]
    assert found["refuses"] and found["runs"] and found["steps"] > 0 and found["same"], found
    assert found["drawn"] == [True, False]


def test_a_fit_writes_to_its_own_scene(run: Any) -> None:
    found = run("several")[0]["scenes"]
    assert found["changed"] and not found["failed"] and "Loss" in found["said"], found
    assert max(found["effects"]) == 1.0, "the effects belong to the rows of the fit's own scene"


def test_the_menu_of_a_nodes_button_adds_its_value(run: Any) -> None:
    found, log = run("buttons")
    assert found["rows"] == ["World: Background: Color"] and found["embedded"] and "Traceback" not in log, found


def test_linked_objects_are_refused(run: Any) -> None:
    found = run("several")[0]["linked"]
    for said in found.values():
        assert "object 'Away'" in said and "is linked from" in said and "make it local first" in said, found
