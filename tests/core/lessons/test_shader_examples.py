"""Lessons "ray_generation_shader", "closest_hit_shader": lines are the slides, colours the hits."""

import numpy as np
import pytest
from accelscope.core.lessons.shader_examples import lines_of_shader

SLIDES = {
    "ray_generation": """
        [shader("raygeneration")] void RayGenMain() { RayDesc ray;
        ray.Origin = SceneConstants.cameraPosition;
        ray.Direction = computeRayDirection(launchIndex); ray.TMin = 0; ray.TMax = 100000;
        Payload payload; TraceRay( scene, 0 /*flags*/, 0xFF /*mask*/, 0 /*hit group offset*/,
        1 /*hit group index multiplier*/, 0 /*miss shader index*/, ray, payload );
        outputTexture[launchIndex.xy] = payload.color; }""",
    "closest_hit": """
        [shader("closesthit")] void ClosestHitMain( inout Payload payload, in Attributes attr) {
        payload.color = float4( attr.barys.x, attr.barys.y, 1 - attr.barys.x - attr.barys.y, 1 );
        payload.hitDistance = RayTCurrent(); }""",
}


@pytest.mark.parametrize("shader", SLIDES)
def test_the_lines_are_those_of_the_slide(shader):
    told = " ".join(line.hlsl for line in lines_of_shader(shader))
    assert "".join(told.split()) == "".join(SLIDES[shader].split())


@pytest.mark.parametrize("name", ["ray_generation_shader", "closest_hit_shader"])
def test_colours_are_the_weights_of_the_hit(play_lesson, name):
    played = play_lesson(name)
    play = played.play
    assert len(play.pixels) > 3
    for number, pixel in enumerate(play.pixels.tolist()):
        picture = played.picture(pixel=number, line=99)
        (image,) = picture.images
        colour = play.launched.colours.reshape(-1, 4)[pixel]
        y, x = divmod(pixel, play.launched.width)
        np.testing.assert_array_equal(image.pixels[y, x], colour[:3])
        (hit,) = play.hits[number]
        corners = played.scene.triangles[hit.primitive]
        point = np.array([colour[2], colour[0], colour[1]]) @ corners
        ray = play.ray_shown(played.lesson.Settings(pixel=number))
        at = ray.origins[0] + hit.t * ray.directions[0]
        np.testing.assert_allclose(point, at, atol=1e-12)
        assert (picture.face_colours[:, :3] == colour[:3]).all(axis=1).any()
