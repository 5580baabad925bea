"""Independent witnesses: Embree through embreex, in single precision."""

from __future__ import annotations

import numpy as np

from ..contract.structure import Hits
from ..errors import InputError
from ..geometry.rays import Rays
from ..scene import Scene


class Embree:
    """Intel Embree over a scene; answers closest hits in single precision."""

    def __init__(self, scene: Scene) -> None:
        try:
            from embreex.mesh_construction import TriangleMesh
            from embreex.rtcore_scene import EmbreeScene
        except ImportError:
            raise InputError(
                "the Embree witness needs embreex; install it with: "
                "pip install 'accelscope[reference]'"
            ) from None
        self._scene = EmbreeScene()
        # Numbers of primitives are those of the flattened scene.
        self._mesh = TriangleMesh(self._scene, scene.flat().triangles.astype(np.float32))

    def trace(self, rays: Rays) -> Hits:
        """Return the closest hits; t is Embree's own, accurate to single precision."""
        found = self._scene.run(
            rays.origins.astype(np.float32), rays.directions.astype(np.float32),
            np.minimum(rays.t_max, 1e37).astype(np.float32), output=True,
        )  # fmt: skip
        primitive = np.asarray(found["primID"], dtype=np.int64)
        t = np.where(primitive >= 0, found["tfar"], np.inf).astype(np.float64)
        return Hits(t, primitive)
