"""Set-ups of fits: options of the command line in a JSON file, and what the panel has stored in the .blend."""

from __future__ import annotations

import argparse
import difflib
import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy

from . import properties
from .problem import Problem
from .session import Request


def add_beginning(parser: argparse.ArgumentParser) -> None:
    """Add the options on where a fit begins, and what it measures at its end."""
    parser.add_argument("--restarts", type=int, metavar="N", help="also fit N other starts, found by a search over "
                        "coarse pictures, for a while, and go on from the best (default: 0)")  # fmt: skip
    parser.add_argument("--search", type=int, metavar="N", help="coarse pictures of the search for a start; 0: none "
                        "(default: enough, if no gradient leads away from the start)")  # fmt: skip
    parser.add_argument("--no-uncertainty", action="store_true", help="do not measure how well the pictures determine "
                        "the result, which takes about a fifth longer, and make no Newton steps at the end")


def beginning(arguments: argparse.Namespace) -> dict[str, int | bool | None]:
    """Return the options of `add_beginning` as fields of a request; None: not given."""
    return {"search": arguments.search, "restarts": arguments.restarts,
            "uncertainty": False if arguments.no_uncertainty else None}  # fmt: skip


def with_setup(parser: argparse.ArgumentParser, argv: list[str], setup: Path) -> list[str]:
    """Return the arguments of a command with the options of a set-up file beside them.

    The file is an object of options by their names without dashes in front; several values are a list, and a switch is
    true or false. Options that `argv` has too, or that exclude one of it, are left out: the command line decides.

    Raises
    ------
    Problem
        If the file can't be read or has an unknown option; names it.
    """
    where = f"setup '{setup}'"
    try:
        found = json.loads(setup.read_text(encoding="utf-8"))
    except OSError as error:
        raise Problem(f"{where}: can't be read ({error.strerror or error})") from None
    except ValueError as error:
        raise Problem(f"{where}: is no JSON ({error})") from None
    if not isinstance(found, dict):
        raise Problem(f'{where}: must be an object of options, such as {{"iterations": 300}}')
    actions = {action.dest: action for action in parser._actions if action.dest not in ("help", "setup")}
    given = parser.parse_args(argv)
    before, behind = list[str](), list[str]()
    for key, value in found.items():
        dest = key.replace("-", "_")
        action = actions.get(dest)
        if action is None:
            near = difflib.get_close_matches(dest, actions, 1)
            instead = f"; did you mean '{near[0]}'?" if near else ""
            raise Problem(f"{where}: there is no option '{key}'{instead}")
        rivals = [one for group in parser._mutually_exclusive_groups if action in group._group_actions
                  for one in group._group_actions]  # fmt: skip
        if any(getattr(given, one.dest) != one.default for one in (action, *rivals)):
            continue
        # An option with several values would take the .blend of `argv` as one of them.
        (behind if action.nargs == "+" else before).extend(_arguments(where, key, action, value))
    return [*before, *argv, *behind]


def _arguments(where: str, key: str, action: argparse.Action, value: Any) -> list[str]:
    if action.nargs == 0:
        if not isinstance(value, bool):
            raise Problem(f"{where}: '{key}' is a switch, so it must be true or false")
        return [action.option_strings[0]] if value else []
    several = isinstance(action.default, list) or action.nargs == "+"
    values = value if isinstance(value, list) and several else [value]
    for one in values:
        if isinstance(one, bool) or not isinstance(one, (str, int, float)):
            raise Problem(f"{where}: '{key}' must be a text or a number{' or a list of them' if several else ''}")
    if not action.option_strings:  # the .blend
        return [str(one) for one in values]
    if action.nargs == "+" and values:
        return [action.option_strings[0], *map(str, values)]
    return [f"{action.option_strings[0]}={one}" for one in values]


@contextmanager
def stored_settings() -> Iterator[None]:
    """Make the settings that the panel stores in scenes readable, also where the add-on is not enabled."""
    if hasattr(bpy.types.Scene, "edgegrad"):
        yield
        return
    for cls in properties.CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.edgegrad = bpy.props.PointerProperty(type=properties.Settings)
    try:
        yield
    finally:
        del bpy.types.Scene.edgegrad
        for cls in reversed(properties.CLASSES):
            bpy.utils.unregister_class(cls)


def stored_request() -> Request:
    """Return the fit that is set in the panel of the open scene.

    Raises
    ------
    Problem
        If no target is stored.
    """
    scene = bpy.context.scene
    if not scene.edgegrad.targets:
        raise Problem(f"scene '{scene.name}': there is no target; name one by --target CAMERA=FILE, give a --setup, or "
                      "store targets in the .blend with the panel")  # fmt: skip
    return properties.request(bpy.context)
