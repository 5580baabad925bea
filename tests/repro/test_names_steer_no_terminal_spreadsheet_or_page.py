"""Names of files and objects are shown, never obeyed: in terminals, spreadsheets and pages."""

import csv
import html.parser
import sys

import numpy as np
import pytest
from accelscope.core.evaluation.records.report import (
    flatten,
    no_formula,
    printable,
    table,
    write_csv,
)

RAYS = ("--rays", "camera:width=4,height=3")
ESCAPES = "a\x1b]0;owned\x07\x1b[31m\u202eb\n\r\x9b2Jc"


def test_printable_text_stays_and_the_rest_is_escaped():
    assert printable("Häuser – 100 % ✓") == "Häuser – 100 % ✓"
    shown = printable(ESCAPES + "\udcff\0")
    assert shown.isprintable()
    assert shown == r"a\x1b]0;owned\x07\x1b[31m\u202eb\n\r\x9b2Jc\udcff\x00"


@pytest.mark.skipif(sys.platform == "win32", reason="no such names there")
def test_names_on_the_terminal(run, obj, tmp_path):
    mesh = obj(np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[np.nan] * 3] * 3]),
               f"{ESCAPES}.obj")  # fmt: skip
    for words in ([mesh], [f"{mesh}.gone"], [mesh, "--structure", ESCAPES],
                  [mesh, "--csv", tmp_path / ESCAPES / "a.csv" / "\x1b[1m"],
                  [mesh, f"--{ESCAPES}"]):  # fmt: skip
        outcome = run("evaluate", *words, *RAYS)
        for line in (outcome.out + outcome.err).split("\n"):
            assert line.isprintable(), line


@pytest.mark.parametrize(
    ("value", "cell"),
    [
        ("=1+1", "'=1+1"),
        ("+cmd|' /C calc'!A0", "'+cmd|' /C calc'!A0"),
        ("-2+3", "'-2+3"),
        ("@SUM(A1)", "'@SUM(A1)"),
        (" =1+1", "' =1+1"),
        ("\t=1", "'\t=1"),
        ("\r=1", "'\r=1"),
        ("\n=1", "'\n=1"),
        ("plain", "plain"),
        ("a=1", "a=1"),
        ("", ""),
        ("-1.5", "-1.5"),
        ("-1.0 2.0 -3e-05", "-1.0 2.0 -3e-05"),
        (-1.5, -1.5),
        (None, None),
        (True, True),
    ],
)
def test_cells(value, cell):
    assert no_formula(value) == cell


def test_names_in_a_spreadsheet(run, obj, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    obj(-(np.arange(1.0, 10.0).reshape(1, 3, 3) ** 2), name='=HYPERLINK("x").obj')
    outcome = run("evaluate", '=HYPERLINK("x").obj', *RAYS, "--csv", "a.csv", "--quiet")
    assert (outcome.code, outcome.err) == (0, "")
    (row,) = csv.DictReader((tmp_path / "a.csv").open())
    assert row["scene.name"] == '\'=HYPERLINK("x")'
    assert row["scene.source"] == '\'=HYPERLINK("x").obj'
    bounds = [float(word) for word in row["scene.bounds"].split()]
    assert bounds == [-49.0, -64.0, -81.0, -1.0, -4.0, -9.0]


def test_sentences_of_a_record_stay_sentences(tmp_path):
    record = {"notes": ["a, b [c]", '"d"'], "none": []}
    assert flatten(record) == {"notes": 'a, b [c]; "d"', "none": ""}
    write_csv(tmp_path / "a.csv", [{"notes": ["=1", "b"]}])
    assert (tmp_path / "a.csv").read_text() == "notes\n'=1; b\n"


class Tags(html.parser.HTMLParser):
    """Collects the tags of a page and the attributes they have."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.attributes = [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.attributes += [name for name, _ in attributes]


NAMES = ["<img src=x onerror=alert(1)>", "'\" onload=x y='", "$figures $scene ${text}",
         "FIGURES ROWS TABLE TEXT SCENE", "&lt;script&gt;", "{parts} %s"]  # fmt: skip


# All of it at once, in fewer characters than a file's name may have; and each alone.
@pytest.mark.parametrize(
    "name", ["".join(NAMES), *(pytest.param(name, marks=pytest.mark.exhaustive) for name in NAMES)]
)
def test_names_on_every_page(run, obj, tmp_path, name):
    pages = {}
    for key, stem in (("plain", "plain"), ("hostile", name)):
        mesh = obj(name=f"{stem}.obj")
        for words in (
            ["evaluate", "--structure", "bvh", "grid:resolution=99999", "sorted_volumes", *RAYS],
            ["efficiency", "--volume", "aabb", "--lines", "500"],
            ["animate", *RAYS],
        ):
            folder = tmp_path / f"{key}-{words[0]}"
            outcome = run(words[0], mesh, *words[1:], "--pictures", folder, "--quiet")
            assert outcome.code == (1 if words[0] == "evaluate" else 0), outcome.err
            pages[key, words[0]] = (folder / "index.html").read_text()
    for command in ("evaluate", "efficiency", "animate"):
        plain, hostile = Tags(pages["plain", command]), Tags(pages["hostile", command])
        assert hostile.tags == plain.tags
        assert hostile.attributes == plain.attributes


@pytest.mark.skipif(sys.platform == "win32", reason="no such names there")
def test_names_on_a_page_turn_no_letters(run, obj, tmp_path):
    """An override would show the rest of the heading backwards; the last one is no letter."""
    mesh = obj(name="a\u202eb\x1b\udcff.obj")
    outcome = run("evaluate", mesh, "--structure", "naive", *RAYS, "--pictures", tmp_path / "p",
                  "--quiet")  # fmt: skip
    assert (outcome.code, outcome.err) == (0, "")
    page = (tmp_path / "p" / "index.html").read_text()
    assert r"<h2>a\u202eb\x1b\udcff &middot; " in page
    assert all(line.isprintable() for line in page.split("\n"))


def test_a_table_of_failed_records():
    record = {"scene": {"name": "s"}, "structure": {"name": "naive", "settings": {}},
              "rays": {"name": "camera"}, "error": "much \x1b[1m too large"}  # fmt: skip
    lines = table([record]).splitlines()
    assert lines[2].split() == ["s", "naive", "camera", "failed:", "much", r"\x1b[1m", "too",
                                "large"]  # fmt: skip
    assert len(lines[1]) < 150
