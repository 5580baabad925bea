"""The bridge to Blender: registration, properties, session, extraction, overlay, jobs.

Imports no ``bpy`` by itself: ``addon.command`` has to run where there is no Blender.
"""

from __future__ import annotations


def register() -> None:
    """Register everything with Blender."""
    from . import registration

    registration.register()


def unregister() -> None:
    """Remove everything that :func:`register` added."""
    from . import registration

    registration.unregister()
