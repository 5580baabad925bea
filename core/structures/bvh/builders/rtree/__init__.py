"""R-trees: nodes of several boxes, by insertion or packed."""
