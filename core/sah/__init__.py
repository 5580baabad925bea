"""What the lecture says of the surface area heuristic itself: planes, curves, an example."""
