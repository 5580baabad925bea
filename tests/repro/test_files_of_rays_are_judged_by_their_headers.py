"""Arrays of an .npz that are no rays, or too large, are refused unread; others are left alone."""

import io
import zipfile

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.evaluation.rays import ray_files
from accelscope.core.evaluation.rays.workloads import FileSettings, FileWorkload

O3, D3 = np.zeros((4, 3)), np.ones((4, 3))
RAN = []


def npy(array, shape=None):
    """Return the bytes of an array; its header may say another shape."""
    buffer = io.BytesIO()
    np.save(buffer, array, allow_pickle=True)
    data = buffer.getvalue()
    if shape is None:
        return data
    header = np.lib.format.header_data_from_array_1_0(array)
    buffer = io.BytesIO()
    np.lib.format.write_array_header_1_0(buffer, {**header, "shape": shape})
    return buffer.getvalue() + array.tobytes()


def written(path, **members):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(f"{name}.npy", data)
    return path


def judged(path):
    """Ask whether the file may be used at all, as is done before anything is built."""
    FileWorkload.refuse_impossible(FileSettings(str(path)))


@pytest.fixture
def unread(monkeypatch):
    """Let no array be unpacked."""

    def read(*arguments, **options):
        raise AssertionError("an array was unpacked")

    monkeypatch.setattr(np.lib.format, "read_array", read)
    monkeypatch.setattr(np, "load", read)


def test_judging_unpacks_no_array(unread, tmp_path):
    judged(written(tmp_path / "rays.npz", origins=npy(O3), directions=npy(D3)))


def test_other_arrays_are_not_unpacked(tmp_path, monkeypatch):
    opened = []
    original = zipfile.ZipFile.open

    def open_member(self, name, *arguments, **options):
        opened.append(name)
        return original(self, name, *arguments, **options)

    path = written(tmp_path / "rays.npz", bomb=b"no array at all", origins=npy(O3),
                   objects=npy(np.array([Loaded()])), directions=npy(D3))  # fmt: skip
    monkeypatch.setattr(zipfile.ZipFile, "open", open_member)
    settings = FileSettings(str(path))
    FileWorkload.refuse_impossible(settings)
    assert len(FileWorkload.make(None, settings)) == 4
    assert set(opened) == {"origins.npy", "directions.npy"}
    assert RAN == []


class Loaded:
    """Tells when it is unpickled."""

    def __reduce__(self):
        return RAN.append, ("run",)


NAN, OBJECTS = npy(O3 + np.nan), npy(np.array([[Loaded()] * 3] * 4, dtype=object))


@pytest.mark.parametrize(
    ("members", "line"),
    [
        ({"origins": OBJECTS, "directions": npy(D3)}, "origins holds objects, which are not read"),
        ({"origins": npy(O3), "directions": npy(D3), "t_max": OBJECTS}, "t_max holds objects"),
        ({"origins": npy(O3 + 1j), "directions": npy(D3)}, "origins holds complex128, not real"),
        ({"origins": npy(np.full((4, 3), "1")), "directions": npy(D3)}, "not real numbers"),
        ({"origins": npy(O3), "directions": npy(D3.view("f8,f8,f8"))}, "not real numbers"),
        ({"origins": npy(O3, (10**14, 3)), "directions": npy(D3, (10**14, 3))}, "take fewer rays"),
        ({"origins": npy(O3, (5, 3)), "directions": npy(D3, (5, 3))}, "origins is cut off"),
        ({"origins": npy(O3, (4, 10**12)), "directions": npy(D3)}, "must both be n x 3"),
        ({"origins": npy(O3, (-4, 3)), "directions": npy(D3)}, "a side that no array has"),
        ({"origins": npy(O3), "directions": npy(D3), "t_max": npy(O3)}, "one value per ray"),
        ({"origins": npy(O3[:0]), "directions": npy(D3[:0])}, "has no rays"),
        ({"origins": npy(O3)}, "no array named directions"),
        ({"origins": b"\x93NUMPY\x02\0\0\0\0\x20" + b" " * 2**20, "directions": npy(D3)},
         "header of 536870912 bytes"),
    ],
)  # fmt: skip
def test_what_headers_tell(unread, tmp_path, members, line):
    with pytest.raises(InputError) as refused:
        judged(written(tmp_path / "rays.npz", **members))
    assert line in str(refused.value)
    assert str(refused.value).count("\n") == 0
    assert RAN == []


def test_an_array_of_another_format(tmp_path):
    path = tmp_path / "rays.npz"
    path.write_bytes(npy(O3))
    with pytest.raises(InputError, match=r"is a single array \(.npy\), whatever its name"):
        judged(path)


def test_what_only_the_numbers_tell(run, tmp_path):
    path = written(tmp_path / "rays.npz", origins=NAN, directions=npy(D3))
    judged(path)
    with pytest.raises(InputError, match=r"rays.npz: 4 rays are not finite"):
        ray_files.read_rays(path)


@pytest.mark.parametrize("dtype", ["<f8", ">f4", "<i4", "|u1", "<f2", "|b1"])
@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("t_max", [None, 2.0, [2.0], [1.0, 2.0, 3.0, 4.0]])
def test_numbers_of_any_kind_are_rays(tmp_path, dtype, order, t_max):
    arrays = {"origins": O3.astype(dtype, order), "directions": D3.astype(dtype, order)}
    if t_max is not None:
        arrays["t_max"] = np.array(t_max)
    np.savez(tmp_path / "rays.npz", **arrays)
    rays = FileWorkload.make(None, FileSettings(str(tmp_path / "rays.npz")))
    assert np.array_equal(rays.origins, O3)
    assert np.array_equal(rays.directions, D3)
    assert np.array_equal(rays.t_max, np.broadcast_to(np.inf if t_max is None else t_max, 4))
