"""What the user sees: the sidebar tab AccelScope; a module lists its classes in CLASSES.

Panels read state and call operators; they compute nothing.
"""
