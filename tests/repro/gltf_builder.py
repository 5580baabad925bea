"""What the repro tests of glTF make their files with."""

import base64
import json

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.files import load_mesh_file

COMPONENTS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
WIDTHS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
TRIANGLE = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


class Builder:
    """A glTF file in the making: one mesh, numbers in one buffer."""

    def __init__(self):
        self.data = b""
        self.root = {"asset": {"version": "2.0"}, "accessors": [], "bufferViews": [],
                     "meshes": [{"primitives": []}], "nodes": [{"mesh": 0}],
                     "scenes": [{"nodes": [0]}], "scene": 0}  # fmt: skip

    def view(self, data, **more):
        self.data += bytes(-len(self.data) % 4)
        self.root["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data), **more}
        )
        self.data += data
        return len(self.root["bufferViews"]) - 1

    def accessor(self, values, dtype="f4", **more):
        array = np.asarray(values, dtype="<" + dtype)
        array = array.reshape(len(array), -1)
        entry = {"bufferView": self.view(array.tobytes()), "componentType": COMPONENTS[dtype],
                 "count": len(array), "type": WIDTHS[array.shape[1]], **more}  # fmt: skip
        self.root["accessors"].append(entry)
        return len(self.root["accessors"]) - 1

    def primitive(self, vertices=None, indices=None, *, dtype="u2", position=None, **more):
        position = self.accessor(vertices) if position is None else position
        entry = {"attributes": {"POSITION": position}, **more}
        if indices is not None:
            entry["indices"] = self.accessor(indices, dtype)
        self.root["meshes"][0]["primitives"].append(entry)
        return entry

    def save(self, path, **buffer):
        buffer = buffer or {
            "uri": "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
        }
        self.root["buffers"] = [{"byteLength": len(self.data), **buffer}]
        path.write_text(json.dumps(self.root))
        return path

    def load(self, folder):
        return load_mesh_file(self.save(folder / "m.gltf"), "flatten")


def refused(builder, folder):
    with pytest.raises(InputError) as caught:
        builder.load(folder)
    return str(caught.value)
