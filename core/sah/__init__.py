"""What the lecture says of the heuristic and of volumes: planes, curves, lines, times."""
