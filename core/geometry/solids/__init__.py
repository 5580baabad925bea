"""Elementary solids: what a ray can hit beside triangles at rest."""
