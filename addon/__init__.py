"""Edgegrad's Blender add-on: exports a scene, fits it to pictures, and writes the result back."""

from __future__ import annotations


def register() -> None:
    """Called by Blender when the add-on is enabled."""
    from . import load_failure

    if load_failure.register():
        return
    from . import registration

    registration.register()


def unregister() -> None:
    """Called by Blender when the add-on is disabled."""
    from . import load_failure

    if load_failure.unregister():
        return
    from . import registration

    registration.unregister()
