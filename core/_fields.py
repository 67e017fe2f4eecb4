"""One table of checks for each public dataclass: a check per field, made before anything reads the fields."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any, ClassVar

# Takes where the value is, the field's name and the value; returns the value to keep (`_check`).
Check = Callable[[str, str, Any], Any]


def by(check: Callable[..., Any], *args: Any, **limits: Any) -> Check:
    """A check of `_check` with its shape or limits."""
    return lambda where, name, value: check(where, name, value, *args, **limits)


def optional(check: Check) -> Check:
    """A check of a value that may be None."""
    return lambda where, name, value: None if value is None else check(where, name, value)


def near(name: str, among: Any) -> str:
    """ "; did you mean 'roughness'?" for a misspelt name, or nothing where no name is like it."""
    found = difflib.get_close_matches(name, list(among), 1)
    return f"; did you mean '{found[0]}'?" if found else ""


class Checked:
    """Base of public dataclasses.

    Attributes
    ----------
    checks
        Field to its check, for each field of the dataclass.
    """

    checks: ClassVar[Mapping[str, Check]] = {}

    def check_fields(self, where: str) -> None:
        """Bring each field into the form that the package computes with; ``ValueError`` names the first wrong one."""
        for name, check in self.checks.items():
            value = getattr(self, name)
            kept = check(where, name, value)
            if kept is not value:
                object.__setattr__(self, name, kept)

    def __setattr__(self, name: str, value: Any) -> None:
        # A misspelt name would otherwise be taken in silence, and change nothing.
        if name not in self.__dataclass_fields__:  # type: ignore[attr-defined]
            known = [f.name for f in fields(self)]  # type: ignore[arg-type]
            raise AttributeError(f"{type(self).__name__} has no field '{name}'{near(name, known)}")
        object.__setattr__(self, name, value)
