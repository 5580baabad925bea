"""A lesson that is played, over its own sample or another scene."""

import itertools

import numpy as np
import pytest
from accelscope.core.lessons import lesson_named
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
