"""A lesson that is played, over its own sample or another scene."""

import itertools

import numpy as np
import pytest
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.drawing import Chart
from accelscope.core.progress import SILENT
from accelscope.core.scene import Scene
from accelscope.sample_scenes import make_sample


class Played:
    """A lesson played over one scene with some knobs."""

    def __init__(self, name, scene, knobs):
        self.lesson = lesson_named(name)
        self.scene = scene or make_sample(self.lesson.sample)
        self.subject = self.lesson.subject(self.scene)
        self.settings = self.lesson.Settings(**knobs)
        self.play = self.lesson.play(self.subject, self.settings, SILENT)

    def picture(self, **knobs):
        """The picture of other knobs that replay nothing; those beyond their ends are at them."""
        assert not set(knobs) & set(self.lesson.replays)
        settings = self.lesson.Settings(**(vars(self.settings) | knobs))
        return self.play.picture(self.play.within(settings))

    def row(self, label, **knobs):
        """The text of a row of figures."""
        (text,) = [row.text for row in self.picture(**knobs).rows if row.label == label]
        return text


@pytest.fixture(scope="session")
def play_lesson():
    """Return a function that plays a lesson: by name, scene (its sample), and knobs."""
    return lambda name, scene=None, **knobs: Played(name, scene, knobs)


class ReadChart:
    """A chart of a picture, read back: what stands on it, in the chart's own units."""

    def __init__(self, chart, picture):
        self.chart, self.picture = chart, picture

    def shares(self, points):
        """Where points (..., 3) are, in shares of the chart's width and height, (..., 2)."""
        away, sides = points - self.chart.origin, (self.chart.across, self.chart.upwards)
        return np.stack([away @ side / (side @ side) for side in sides], axis=-1)

    def values(self, points):
        """The x and y of points (..., 3), (..., 2)."""
        along, above = np.moveaxis(self.shares(points), -1, 0)
        return np.stack([self.chart.low + self.chart.span * along, self.chart.top * above], axis=-1)

    def there(self, shapes):
        """Which lines or faces (n, k, 3) stand on the chart; a star may stick out a little."""
        across, upwards = self.chart.across, self.chart.upwards
        normal = np.cross(across, upwards)
        away = (shapes - self.chart.origin) @ normal / np.linalg.norm(normal)
        is_flat = (np.abs(away) <= 0.1 * np.linalg.norm(upwards)).all(axis=1)
        return is_flat & (np.abs(self.shares(shapes) - 0.5) <= 0.6).all(axis=(1, 2))

    def lines(self, colour):
        """Lines of a colour and opacity, (k, 2, 2)."""
        segments = self.picture.segments[(self.picture.colours == colour).all(axis=1)]
        return self.values(segments[self.there(segments)])

    def curve(self, colour):
        """The points of a curve without a break, (k, 2); no other line has its colour."""
        lines = self.lines(colour)
        np.testing.assert_allclose(lines[1:, 0], lines[:-1, 1], atol=1e-9 * self.chart.top)
        return np.concatenate([lines[:1, 0], lines[:, 1]])

    def stars(self, colour):
        """The middles of stars of a colour, (k, 2)."""
        return self.lines(colour).reshape(-1, 3, 2, 2).mean(axis=(1, 2))

    def rectangles(self, colour, low=None):
        """Bars of a colour of any opacity, or those of the row that begins at a height.

        Left, low, right and high, (k, 4).
        """
        faces = self.picture.faces[(self.picture.face_colours[:, :3] == colour[:3]).all(axis=1)]
        corners = self.values(faces[self.there(faces)]).reshape(-1, 6, 2)
        found = np.concatenate([corners.min(axis=1), corners.max(axis=1)], axis=1)
        return found if low is None else found[np.isclose(found[:, 1], low)]


@pytest.fixture(scope="session")
def read_charts():
    """Return a function that makes a picture and reads back its charts: by play and settings."""

    def read(play, settings):
        made, begin = [], Chart.__init__

        def noted(chart, *args):
            begin(chart, *args)
            made.append(chart)

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(Chart, "__init__", noted)
            picture = play.picture(play.within(settings))
        return [ReadChart(chart, picture) for chart in made]

    return read


@pytest.fixture(scope="session")
def octahedron():
    """|x| + |y| + |z| <= 1, of which many figures are known."""
    signs = itertools.product((-1.0, 1.0), repeat=3)
    return Scene.from_triangles([np.diag(each) for each in signs], "octahedron")


@pytest.fixture(scope="session")
def muddle():
    """Triangles of many sizes that overlap: all that builders and optimisers do happens."""
    rng = np.random.default_rng(4)
    size = np.concatenate([np.full(240, 0.1), np.full(40, 0.6), np.full(20, 2.0)])
    corners = rng.random((300, 1, 3)) + size[:, None, None] * rng.random((300, 3, 3))
    return Scene.from_triangles(corners, "muddle")
