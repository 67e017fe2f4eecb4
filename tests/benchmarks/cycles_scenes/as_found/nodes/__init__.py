"""What nodes do to spaces, sockets and bodies."""

from __future__ import annotations

from . import carriers, changing, of_objects, spaces  # noqa: F401  (importing a family registers its cases)
