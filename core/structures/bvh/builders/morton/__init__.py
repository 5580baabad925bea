"""Builders along the Morton curve."""
