"""Lesson "less_rays_recursion": rays that would add too little to a pixel are not sent.

"Less rays" of the slide "Classification": dynamic recursion control. What a ray sees is multiplied
by the share that is mirrored or transmitted wherever it was sent on; where that has become less
than the threshold, the ray is not sent (R. Hall, D. Greenberg, 1983); the light that a shadow ray
was to ask for then arrives unasked. Shown is the tree of one pixel. The primary ray is violet,
reflected ones are blue, refracted ones green, those to lights orange; those that are not sent are
dashed. Beside it is the picture without them.

In a scene where nothing mirrors, everything is taken as half a mirror.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..printing import show_integer
from ..progress import Progress
from ..scene import Scene
from ..scene.material import MATT
from ..scene.whitted.film import Film, error_of
from ..scene.whitted.trees import OF_PRIMARY, OF_SHADOW
from ..settings import setting
from .drawing import GREY, Lines, coloured, counted, faint, items_in, picture_of
from .heat_map import camera_of, viridis
from .lesson import Lesson, Play, Subject
from .picture import Image, Mark, Picture, Row
from .rays_of_picture import COLOURS, rays_of_picture

DEPTH = 6

TREES = 12
"""Pixels whose trees can be looked at, from the smallest to the largest."""

WIDTH = 84
"""Pixels in a row, and rows."""

DASHES = 9
"""Of a ray that is not sent."""

REACH, TO_LIGHT = 0.16, 0.08
"""How much of a ray that hits nothing is drawn, and of one to a light, in the scene's diagonal."""

MOST_MARKS = 5


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    threshold: float = setting(
        0.05, "Threshold", "A ray is not sent if it could add less than this to its pixel",
        minimum=0.0, maximum=0.2,
    )  # fmt: skip
    tree: int = setting(
        TREES - 1, "Tree", "Which pixel's tree is shown, from the smallest to the largest",
        minimum=0,
    )  # fmt: skip


def with_mirrors(scene: Scene) -> Scene:
    """Return a scene in which something mirrors; where nothing does, all of it does by half."""
    materials = scene.materials or (MATT,)
    if any(each.specular or each.transmission for each in materials):
        return scene
    halves = tuple(dataclasses.replace(each, diffuse=0.5, specular=0.5) for each in materials)
    return dataclasses.replace(scene, materials=halves)


class Recursion(Play):
    """All rays of a picture, with what each adds."""

    def __init__(self, subject: Subject, progress: Progress) -> None:
        scene = self.scene = with_mirrors(subject.scene)
        self.is_made_to_mirror = scene is not subject.scene
        film = Film(WIDTH, WIDTH, 1, is_adaptive=False)
        self.rays = rays_of_picture(
            subject.structures[0], scene, camera_of(scene), film, DEPTH, progress
        )
        self.whole = self.picture_by(Settings(threshold=0.0))
        sizes = np.bincount(self.rays.samples, minlength=len(film))
        seen = np.flatnonzero(self.rays.objects >= 0)
        order = seen[np.argsort(sizes[seen], kind="stable")]
        places = np.linspace(0, len(order) - 1, min(TREES, len(order)))
        self.pixels = order[np.round(places).astype(np.int64)]
        self.ends = {"tree": len(self.pixels) - 1}

    def film(self, lesson: Lesson) -> list[float]:
        """Return thresholds that grow by a third from one to the next."""
        steps = np.geomspace(0.002, 0.2, 17).tolist()
        return [0.0, *(float(f"{step:.2g}") for step in steps)]

    def on_page(self, lesson: Lesson, settings: Settings) -> list[Settings]:
        """Return all rays, and what is left of them at three thresholds."""
        return [dataclasses.replace(settings, threshold=each) for each in (0.0, 0.01, 0.05, 0.1)]

    def picture_by(self, settings: Settings) -> np.ndarray:
        """Return the picture, (height, width, 3), by the rays that are sent."""
        film, rays, sent = self.rays.film, self.rays, self.sent(settings)
        # From a hit that is seen, light arrives also where it is not asked for.
        unasked = ~sent & (rays.classes == OF_SHADOW)
        unasked &= rays.parent_strengths >= settings.threshold
        return rays.colours(sent, unasked).reshape(film.height, film.width, 3)

    def sent(self, settings: Settings) -> np.ndarray:
        """Say which rays are sent, (n,) bool.

        Whatever comes of a ray adds no more than itself: where one is not sent, none of its
        descendants is.
        """
        return (self.rays.strengths >= settings.threshold) | (self.rays.classes == OF_PRIMARY)

    def picture(self, settings: Settings) -> Picture:
        """Return one tree, and the picture by the rays that are sent."""
        rays, sent = self.rays, self.sent(settings)
        own = rays.samples == self.pixels[settings.tree]
        parts = [
            items_in(self.scene, np.arange(len(self.scene)), GREY, 0.1),
            *(self.lines(np.flatnonzero(own & ~sent), is_dashed=True)),
            *(self.lines(np.flatnonzero(own & sent), is_dashed=False)),
        ]
        shown = self.picture_by(settings)
        rms, most = error_of(shown, self.whole)
        saved, total = int((~sent).sum()), len(sent)
        caption = (
            f"Threshold {settings.threshold:.3g}: {show_integer(saved)} of {show_integer(total)} "
            f"rays of the picture are not sent, {saved / total:.0%}; it is off by {rms:.2g} RMS, "
            f"{most:.2g} at most; of the {counted(int(own.sum()), 'ray', 'rays')} of this pixel "
            f"{counted(int((own & sent).sum()), 'is', 'are')} sent"
        )
        images = (
            Image("picture", np.minimum(shown, 1.0)),
            self.error(shown),
        )
        return picture_of(
            parts, caption, marks=self.marks(own & sent), rows=self.rows(sent, rms, most),
            images=images,
        )  # fmt: skip

    def error(self, shown: np.ndarray) -> Image:
        """Return where the picture is off, from dark to the brightest: 0.1 or more."""
        off = np.abs(np.minimum(shown, 1.0) - np.minimum(self.whole, 1.0)).max(axis=2)
        return Image("error", viridis(np.minimum(off / 0.1, 1.0)), off)

    def lines(self, numbers: np.ndarray, *, is_dashed: bool) -> list[Lines]:
        """Return some rays as lines, in the colours of their classes."""
        rays = self.rays
        begin, end = rays.origins[numbers], rays.ends[numbers].copy()
        classes, units = rays.classes[numbers], rays.directions[numbers]
        units = units / np.linalg.norm(units, axis=1, keepdims=True)
        reach = self.scene.diagonal
        is_open = ~np.isfinite(end).all(axis=1)
        end[is_open] = begin[is_open] + REACH * reach * units[is_open]
        is_long = (classes == OF_SHADOW) & (np.linalg.norm(end - begin, axis=1) > TO_LIGHT * reach)
        end[is_long] = begin[is_long] + TO_LIGHT * reach * units[is_long]
        # Of a camera that is far away only the last part of its rays.
        is_far = (classes == OF_PRIMARY) & (np.linalg.norm(end - begin, axis=1) > REACH * reach)
        begin = np.where(is_far[:, None], end - REACH * reach * units, begin)
        parts = []
        for number, colour in enumerate(COLOURS):
            which = classes == number
            segments = np.stack([begin[which], end[which]], axis=1)
            if is_dashed:
                parts.append(coloured(dashed(segments), faint(colour, 0.6)))
            else:
                parts.append(coloured(segments, colour))
        return parts

    def marks(self, shown: np.ndarray) -> list[Mark]:
        """Return the weights of the strongest rays sent on."""
        marks: list[Mark] = []
        rays = self.rays
        onward = np.flatnonzero(shown & (rays.classes > OF_SHADOW))
        onward = onward[np.argsort(-rays.strengths[onward], kind="stable")][:MOST_MARKS]
        for number in onward:
            way = rays.directions[number]
            way = way / np.linalg.norm(way)
            length = min(
                float(np.linalg.norm(rays.ends[number] - rays.origins[number])),
                REACH * self.scene.diagonal,
            )
            place = rays.origins[number] + 0.6 * length * way
            colour = COLOURS[int(rays.classes[number])]
            marks.append(Mark(place, f"{rays.strengths[number]:.2g}", colour[:3]))
        return marks

    def rows(self, sent: np.ndarray, rms: float, most: float) -> list[Row]:
        """Return how many rays of each depth are sent, and how far the picture is off."""
        depths = self.rays.depths
        rows = [
            Row(
                f"Depth {depth}",
                f"{show_integer((sent & (depths == depth)).sum())} of "
                f"{show_integer((depths == depth).sum())} rays",
                "sent, with the shadow rays from where they hit",
            )
            for depth in np.unique(depths).tolist()
        ]
        rows += [
            Row("Rays Saved", f"{np.mean(~sent):.1%}", "of all rays of the picture"),
            Row("Error, RMS", f"{rms:.2g}", "of a colour of a pixel; 1 is from black to white"),
            Row("Error, Most", f"{most:.2g}", "the same where it is worst"),
        ]
        if self.is_made_to_mirror:
            rows.append(Row("Materials", "half a mirror", "nothing mirrors in the scene itself"))
        return rows


def dashed(segments: np.ndarray) -> np.ndarray:
    """Return segments (k, 2, 3) as dashes."""
    begin, along = segments[:, 0], segments[:, 1] - segments[:, 0]
    steps = np.arange(DASHES) / (DASHES - 0.5)
    starts = begin[:, None] + steps[:, None] * along[:, None]
    ends = starts + 0.5 / (DASHES - 0.5) * along[:, None]
    return np.stack([starts, ends], axis=2).reshape(-1, 2, 3)


def play(subject: Subject, settings: Any, progress: Progress) -> Play:
    """Trace all rays of the picture."""
    return Recursion(subject, progress)


LESSONS = (
    Lesson(
        name="less_rays_recursion",
        label="Rays That Would Add Too Little",
        slide="Classification",
        begin="A mirror that sees a mirror adds little to the pixel: the tree of rays is cut where "
        "no eye would notice",
        look_for="Violet is the primary ray, blue what is reflected, green what is refracted, "
        "orange goes to the light. The numbers are what a ray may add at most: less each time it "
        "is sent on. Dashed rays are not sent, and nothing that would come of them; light that is "
        "not asked for arrives",
        question="Why not simply stop at a smaller depth?",
        answer="A depth cuts strong rays as well: light through glass is worth following far, its "
        "weak reflections are not worth one step. The threshold asks what a ray is worth",
        source="scene.whitted.trees",
        sample="mount:size=3",
        structures=("bvh",),
        Settings=Settings,
        play=play,
        film="threshold",
    ),
)
