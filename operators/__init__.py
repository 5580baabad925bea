"""What the user can do: one thin operator per verb; a module lists its classes in CLASSES."""
