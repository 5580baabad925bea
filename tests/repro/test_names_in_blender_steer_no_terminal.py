"""What objects, scenes and files are called is escaped wherever a line may reach a terminal."""

from __future__ import annotations

import io
from typing import Any

import pytest
from accelscope.core.printing import print_lines, printable
from accelscope.core.progress import TerminalProgress

HOSTILE = "a\x1b[31m\x07\x9b2J\x7f\u202eb\u2066c\u200f"
SHOWN = r"a\x1b[31m\x07\x9b2J\x7f\u202eb\u2066c\u200f"


def test_every_control_character_and_override():
    codes = [*range(0x20), *range(0x7F, 0xA0), 0x200E, 0x200F, 0x061C, *range(0x202A, 0x202F),
             *range(0x2066, 0x206A), 0x2028, 0x2029]  # fmt: skip
    for code in codes:
        assert printable(chr(code)).isascii()
        assert printable(chr(code)).isprintable()
    assert printable("Würfel 立方体 – ½ é") == "Würfel 立方体 – ½ é"


def test_lines_stay_lines():
    file = io.StringIO()
    print_lines(f"one {HOSTILE}\n\ntwo", file)
    assert file.getvalue() == f"one {SHOWN}\n\ntwo\n"


def test_progress(capsys: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    progress = TerminalProgress()
    progress.DELAY = 0.0
    progress.report(1, 2, HOSTILE)
    progress.announce(HOSTILE)
    said = capsys.readouterr().err
    assert SHOWN in said
    assert all(c.isprintable() or c in "\r\n" for c in said)


@pytest.fixture
def reports(bpy: Any, root: Any, current: Any, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Do everything that reports a name; Blender prints reports."""
    from accelscope.addon import jobs
    from accelscope.operators import add_sample_scene, export

    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.name = HOSTILE
    bpy.context.scene.name = HOSTILE
    light = bpy.data.objects.new(HOSTILE, bpy.data.lights.new("sun", "SUN"))
    light.scale = (0, 0, 0)
    bpy.context.collection.objects.link(light)
    said: list[str] = []

    def noting(operator: type, **more: Any) -> Any:
        own = {key: value for key, value in vars(operator).items() if not key.startswith("__")}
        bases = (jobs.JobOperator,) if issubclass(operator, jobs.JobOperator) else ()
        made = type("Pretended", bases, own | more)()
        made.report = lambda kind, text: said.append(text)
        return made

    from accelscope.operators.build import ACCELSCOPE_OT_build

    assert noting(ACCELSCOPE_OT_build).execute(bpy.context) == {"FINISHED"}
    root.workload = "random_lines"
    root.workloads.random_lines.count = 500
    bpy.ops.accelscope.trace()
    monkeypatch.setattr("accelscope.core.evaluation.records.report.write_json", lambda *_: None)
    writing = noting(export.ACCELSCOPE_OT_export, filepath=f"/tmp/{HOSTILE}.json", format="JSON")
    assert writing.execute(bpy.context) == {"FINISHED"}
    sample = {name: getattr(bpy.ops.accelscope.add_sample_scene.get_rna_type().properties[name],
                            "default", None)
              for name in add_sample_scene.operator_properties()}  # fmt: skip
    adding = noting(add_sample_scene.ACCELSCOPE_OT_add_sample_scene, **sample)
    assert adding.execute(bpy.context) == {"FINISHED"}
    return said


def test_reports_in_blender(reports: list[str]) -> None:
    assert len(reports) == 3
    for text in reports:
        assert r"\x1b[31m" in text
        assert text.isprintable()


def test_refusals_in_blender(bpy: Any, capfd: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    from accelscope.addon import jobs
    from accelscope.core.errors import InputError

    bpy.ops.mesh.primitive_cube_add()

    def refuse(*_: Any, **__: Any) -> None:
        raise InputError(f"the mesh of {HOSTILE} is bad", HOSTILE)

    def fail(*_: Any, **__: Any) -> None:
        raise KeyError(HOSTILE)

    for fault in (refuse, fail):
        monkeypatch.setattr("accelscope.core.evaluation.records.experiment.build", fault)
        with pytest.raises(RuntimeError) as caught:
            bpy.ops.accelscope.build()
        assert r"\x1b[31m" in str(caught.value)
        assert str(caught.value).strip().isprintable()
        assert jobs.refusal().isprintable()
    said = capfd.readouterr()
    assert all(c.isprintable() or c == "\n" for c in said.out + said.err)
