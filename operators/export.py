"""Write the figures to a file."""

import os
import re
from pathlib import Path

import bpy
from bpy.props import EnumProperty, StringProperty

from ..addon.results import session
from ..addon.results.wording import refusal_in_panel
from ..core.errors import InputError
from ..core.printing import printable

FORMATS = [
    ("JSON", "JSON", "One record with everything, as the command line writes it"),
    ("CSV", "CSV", "One row, the names of the record flattened into columns"),
]


class ACCELSCOPE_OT_export(bpy.types.Operator):
    bl_idname = "accelscope.export"
    bl_label = "Export Figures"
    bl_description = (
        "Write settings, statistics and the figures of the traced rays to a file, "
        "with the records of a comparison over the timeline, if there was one"
    )
    bl_options = {"REGISTER"}

    format: EnumProperty(name="Format", items=FORMATS)  # type: ignore[valid-type]
    filepath: StringProperty(  # type: ignore[valid-type]
        subtype="FILE_PATH", options={"SKIP_SAVE", "PATH_SUPPORTS_BLEND_RELATIVE"}
    )
    filter_glob: StringProperty(default="*.json;*.csv", options={"HIDDEN"})  # type: ignore[valid-type]

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if session.current.record is None:
            cls.poll_message_set("Build a structure first")
            return False
        return True

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        record = session.current.record
        assert record is not None
        # A scene may be called as no file can be, or as one in another folder.
        scene = re.sub(r'[/\\:*?"<>|]', "_", printable(record["scene"]["name"]))
        name = f"{scene}-{record['structure']['name']}"
        folder = (
            Path(bpy.data.filepath).parent if bpy.data.filepath else Path(os.path.expanduser("~"))
        )
        self.filepath = str(folder / f"{name}.{self.format.lower()}")
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..core.evaluation.records.report import write_csv, write_json

        suffix = f".{self.format.lower()}"
        # As in Blender's window for files: // is the folder of the .blend, ~ that of the user.
        path = Path(os.path.expanduser(bpy.path.abspath(self.filepath)))
        if not path.name:  # nothing, or a folder at the top
            self.report({"ERROR"}, "Name the file to write")
            return {"CANCELLED"}
        if path.suffix.lower() != suffix:
            path = path.with_name(path.name + suffix)
        record = session.current.record
        assert record is not None
        write = write_json if self.format == "JSON" else write_csv
        try:
            write(path, [record, *session.current.timeline])
        except InputError as error:
            self.report({"ERROR"}, refusal_in_panel(error))
            return {"CANCELLED"}
        self.report({"INFO"}, printable(f"Wrote {path}"))
        return {"FINISHED"}


CLASSES = (ACCELSCOPE_OT_export,)
