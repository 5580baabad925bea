"""Trees of hierarchies: made by builders, rearranged, collapsed, widened, fitted with volumes."""
