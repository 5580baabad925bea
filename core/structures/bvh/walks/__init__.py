"""The traversals of hierarchies: of binary trees, and of wide ones."""
