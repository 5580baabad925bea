"""Elements of binary files with no rows, or with no properties, are nothing and no fault."""

import numpy as np
import pytest
from accelscope.core.files import load_mesh_file
from accelscope.core.files.rows import Column, Lists, find_rows, read_rows

FACES = b"\x03" + np.arange(3, dtype="<i4").tobytes()
VERTICES = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype="<f4")


@pytest.mark.parametrize(
    "lines",
    [
        "element edge 0\nproperty int a\nproperty list uint64 int b",
        "element edge 0",
        "element edge 7",
        "element edge 9223372036854775807",
    ],
)
def test_beside_a_triangle(tmp_path, lines):
    path = tmp_path / "mesh.ply"
    path.write_bytes(
        b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\n"
        b"property float y\nproperty float z\n" + lines.encode() + b"\nelement face 1\n"
        b"property list uchar int vertex_indices\nend_header\n" + VERTICES.tobytes() + FACES
    )
    assert np.array_equal(load_mesh_file(path).triangles, VERTICES.astype(float)[None])


def test_no_rows_need_no_kernel(monkeypatch):
    def called(*arguments):
        raise AssertionError(f"{find_rows} is not needed")

    monkeypatch.setattr("accelscope.core.files.rows.call", called)
    i4 = np.dtype("<i4")
    columns = [Column("number", i4), Column("list", i4, np.dtype("<u8"))]
    for data in (np.zeros(0, np.uint8), np.zeros(9, np.uint8)):
        table, end = read_rows(data, len(data), 0, columns, "row")
        assert end == len(data)
        assert (table["number"].dtype, len(table["number"])) == (i4, 0)
        assert isinstance(table["list"], Lists)
        assert (len(table["list"].values), len(table["list"].sizes)) == (0, 0)
