"""Lesson "less_rays_samples": many samples only for pixels that need them.

"Less rays" of the slide "Classification": adaptive anti-aliasing. A pixel begins with one sample.
Where samples beside each other differ, in what they see or in its colour, cells are divided into
four (T. Whitted, CACM 23(6), 1980), until all n x n places of a pixel are taken. In the scene stars
mark where pixels have more than one sample, dark where they have few, bright where they have all;
beside it are the picture and the number of samples of each pixel in the same colours.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.marks import stars
from ..printing import show_integer
from ..progress import Progress
from ..scene.whitted.film import Film, error_of
from ..scene.whitted.trees import OF_PRIMARY
from ..settings import setting
from .drawing import GREY, Lines, items_in, opaque, picture_of, some_of
from .heat_map import camera_of, viridis
from .lesson import Lesson, Play, Subject
from .picture import Image, Picture, Row
from .rays_of_picture import rays_of_picture

WIDTH, DEPTH = 64, 4
"""Pixels in a row, and rows; how many rays may follow each other."""

MOST_STARS = 4000

STAR = 0.01
"""Size of a star in the scene's diagonal."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    contrast: float = setting(
        0.1, "Contrast", "How much red, green or blue of neighbours must differ for a division",
        minimum=0.0, maximum=1.0,
    )  # fmt: skip
    samples: str = setting(
        "4", "Samples", "Samples of a pixel in a row and in a column, at most",
        choices={"2": "2 x 2", "4": "4 x 4", "8": "8 x 8"},
    )  # fmt: skip


class Sampling(Play):
    """The picture of all samples, of which some are taken."""

    def __init__(self, subject: Subject, settings: Settings, progress: Progress) -> None:
        scene = self.scene = subject.scene
        self.side = int(settings.samples)
        self.size = WIDTH, WIDTH
        film = Film(*self.size, self.side, is_adaptive=False)
        rays = rays_of_picture(
            subject.structures[0], scene, camera_of(scene), film, DEPTH, progress
        )
        everything = np.ones(len(rays.samples), dtype=bool)
        self.colours, self.objects = rays.colours(everything), rays.objects
        self.points = rays.ends[rays.classes == OF_PRIMARY]
        self.sizes = np.bincount(rays.samples, minlength=len(film))
        film.colours[:] = self.colours
        self.whole = film.picture()
        one = Film(*self.size, self.side, is_adaptive=True)
        one.colours[:] = self.colours[one.places()]
        self.error_of_one = error_of(one.picture(), self.whole)

    def film(self, lesson: Lesson) -> list[float]:
        """Return contrasts from none to one that no colours have."""
        return [0.01 * step for step in range(0, 50, 2)]

    def developed(self, settings: Settings) -> Film:
        """Return the film of adaptive samples: each has the colour that it has among all."""
        film = Film(*self.size, self.side, is_adaptive=True)
        while True:
            places = film.places()
            film.colours[:] = self.colours[places]
            film.see(np.arange(len(film)), self.objects[places])
            if not film.divide(settings.contrast):
                return film

    def picture(self, settings: Settings) -> Picture:
        """Return where samples went, and the picture that they make."""
        film = self.developed(settings)
        shown, samples = film.picture(), film.samples()
        rms, most = error_of(shown, self.whole)
        taken = film.places()
        rays, total = int(self.sizes[taken].sum()), int(self.sizes.sum())
        shades = viridis(np.log2(samples) / np.log2(self.side**2))
        many, places = samples.ravel()[film.pixels()], taken
        where = np.flatnonzero((many > 1) & np.isfinite(self.points[places]).all(axis=1))
        where = some_of(where, MOST_STARS)
        marks = stars(self.points[places[where]], np.full(len(where), STAR * self.scene.diagonal))
        colours = shades.reshape(-1, 3)[film.pixels()[where]]
        parts = [
            items_in(self.scene, np.arange(len(self.scene)), GREY, 0.12, most=800),
            Lines(marks, opaque(colours).repeat(3, axis=0)),
        ]
        full = f"{self.side} x {self.side}"
        caption = (
            f"{show_integer(len(film))} samples instead of {show_integer(len(self.colours))}, "
            f"{len(film) / samples.size:.1f} for a pixel: {1.0 - rays / total:.0%} of the rays are "
            f"saved against {full} everywhere; the picture is off by {rms:.2g} RMS, {most:.2g} at "
            "most"
        )
        rows = (
            Row("Samples", f"{len(film) / samples.size:.2f} per pixel", f"{self.side**2} at most"),
            Row("Pixels with One", f"{np.mean(samples == 1):.0%}", "where nothing differs"),
            Row("Pixels with All", f"{np.mean(samples == self.side**2):.0%}", f"{full} samples"),
            Row("Rays", f"{show_integer(rays)} of {show_integer(total)}",
                "with all that descends from them"),
            Row("Rays Saved", f"{1.0 - rays / total:.1%}", f"against {full} everywhere"),
            Row("Error, RMS", f"{rms:.2g}", "of a colour of a pixel; 1 is from black to white"),
            Row("Error, Most", f"{most:.2g}", "the same where it is worst"),
            Row("Error with One", f"{self.error_of_one[0]:.2g}",
                "RMS, if each pixel had one sample alone"),
        )  # fmt: skip
        images = (
            Image("picture", np.minimum(shown, 1.0)),
            Image("samples", shades, samples),
        )
        return picture_of(parts, caption, rows=rows, images=images)


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Trace the rays of all samples."""
    return Sampling(subject, settings, progress)


LESSONS = (
    Lesson(
        name="less_rays_samples",
        label="Where Adaptive Samples Went",
        slide="Classification",
        begin="Jagged edges want many samples, but most pixels see one thing in one colour: these "
        "need no second one",
        look_for="Bright are pixels that took all their samples: outlines, shadows' edges, "
        "reflections; the dark ones took one, and are as right",
        question="What can adaptive samples miss that a fixed number would find?",
        answer="What lies between all first samples, such as a thin wire: where no sample differs, "
        "nothing is divided",
        source="scene.whitted.film",
        sample="teapot:size=6",
        structures=("bvh",),
        Settings=Settings,
        play=play,
        film="contrast",
        replays=("samples",),
    ),
)
