# SPDX-License-Identifier: GPL-3.0-or-later
"""AccelScope: see, step through and measure ray tracing acceleration structures.

Blender insists on this file beside ``blender_manifest.toml``. It imports the add-on only when
Blender asks for it, so that ``accelscope.core`` can be used, and tested, without Blender.
"""


def register() -> None:
    """Register the add-on with Blender."""
    from . import addon

    addon.register()


def unregister() -> None:
    """Remove everything that `register` added."""
    from . import addon

    addon.unregister()
