"""Objects whose state can be stored, to go on from it later."""

from __future__ import annotations

from typing import Any, ClassVar

State = dict[str, Any]


class Resumable:
    """An object with a state: the attributes that its steps change. All others follow from how it was made.

    Attributes
    ----------
    changing
        Names of these attributes: numbers, arrays, lists and dictionaries of them, None, or other `Resumable`s.
    """

    changing: ClassVar[tuple[str, ...]] = ()

    def state(self) -> State:
        """Return the attributes that steps change; their arrays must not be written to."""
        found = {}
        for name in self.changing:
            value = getattr(self, name)
            found[name] = value.state() if isinstance(value, Resumable) else value
        return found

    def restore(self, state: State) -> None:
        """Take over what `state` has returned for an object that was made in the same way."""
        for name in self.changing:
            value = getattr(self, name)
            if isinstance(value, Resumable):
                value.restore(state[name])
            else:
                setattr(self, name, state[name])
