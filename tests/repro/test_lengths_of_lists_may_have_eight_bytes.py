"""Lists of binary PLY with lengths of 64 bits: read, or refused where they are beyond the file."""

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.files import load_mesh_file

VERTICES = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float)


def written(path, kind, order, faces, lengths=None):
    """Write faces whose lists have lengths of a kind; `lengths` says others than there are."""
    lengths = [len(face) for face in faces] if lengths is None else lengths
    rows = b"".join(
        np.array([length], order + kind).tobytes() + np.array(face, f"{order}i4").tobytes()
        for length, face in zip(lengths, faces, strict=True)
    )
    name = {"u8": "uint64", "i8": "int64", "u4": "uint", "i4": "int", "u1": "uchar", "i1": "char"}
    endian = {"<": "little", ">": "big"}[order]
    head = (
        f"ply\nformat binary_{endian}_endian 1.0\nelement vertex 4\nproperty double x\n"
        f"property double y\nproperty double z\nelement face {len(faces)}\n"
        f"property list {name[kind]} int vertex_indices\nend_header\n"
    )
    path.write_bytes(head.encode() + VERTICES.astype(f"{order}f8").tobytes() + rows)
    return path


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("kind", ["u8", "i8", "u4", "i4", "u1", "i1"])
def test_lists_of_different_lengths(tmp_path, kind, order):
    path = written(tmp_path / "mesh.ply", kind, order, [[0, 1, 2], [0, 1, 2, 3], [3, 0, 1]])
    wanted = VERTICES[[[0, 1, 2], [0, 1, 2], [0, 2, 3], [3, 0, 1]]]
    assert np.array_equal(load_mesh_file(path).triangles, wanted)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("row", [0, 1])
@pytest.mark.parametrize(
    ("kind", "length"),
    [("u8", 2**64 - 1), ("u8", 2**63), ("u8", 2**63 - 1), ("u8", 2**62), ("u8", 2**61 + 3),
     ("u8", 2**40), ("i8", 2**63 - 1), ("i8", -1), ("i8", -(2**63)), ("i8", -(2**61) + 3),
     ("u4", 2**32 - 1), ("i4", -1), ("i1", -1), ("u1", 255)],
)  # fmt: skip
def test_lengths_beyond_the_file(tmp_path, kind, length, order, row):
    lengths = [3, 4]
    lengths[row] = length
    path = written(tmp_path / "mesh.ply", kind, order, [[0, 1, 2], [0, 1, 2, 3]], lengths)
    with pytest.raises(InputError, match=f"'face' {row + 1} of 2 is not whole"):
        load_mesh_file(path)
