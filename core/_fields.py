"""Field checks of the public dataclasses.

Each dataclass has one table that maps a field to its check. `Checked.check_fields` runs the table before any other code
reads the fields, so all later code may rely on their types, shapes and ranges.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any, ClassVar

# check(where, name, value) -> the value in the form that the package computes with (see `_check`).
Check = Callable[[str, str, Any], Any]


def by(check: Callable[..., Any], *args: Any, **limits: Any) -> Check:
    """Bind shape or limits to a check of `_check`."""
    return lambda where, name, value: check(where, name, value, *args, **limits)


def optional(check: Check) -> Check:
    """Extend a check so that it accepts None."""
    return lambda where, name, value: None if value is None else check(where, name, value)


def near(name: str, among: Any) -> str:
    """Return "; did you mean 'roughness'?" for a misspelt name, or "" if no known name is similar."""
    found = difflib.get_close_matches(name, list(among), 1)
    return f"; did you mean '{found[0]}'?" if found else ""


class Checked:
    """Base class of the public dataclasses.

    Attributes
    ----------
    checks
        Maps each field of the dataclass to its check.
    """

    checks: ClassVar[Mapping[str, Check]] = {}

    def check_fields(self, where: str) -> None:
        """Convert each field to the form that the package computes with; ``ValueError`` names the first wrong field."""
        for name, check in self.checks.items():
            value = getattr(self, name)
            kept = check(where, name, value)
            if kept is not value:
                object.__setattr__(self, name, kept)

    def __setattr__(self, name: str, value: Any) -> None:
        # Python would accept an assignment to a misspelt name, and it would have no effect.
        if name not in self.__dataclass_fields__:  # type: ignore[attr-defined]
            known = [f.name for f in fields(self)]  # type: ignore[arg-type]
            raise AttributeError(f"{type(self).__name__} has no field '{name}'{near(name, known)}")
        object.__setattr__(self, name, value)


class CheckedAtOnce(Checked):
    """Base class of those that are checked when they are made; messages name their class."""

    def __post_init__(self) -> None:
        self.check_fields(type(self).__name__)
