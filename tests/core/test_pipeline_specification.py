"""The sentences of the specification, one test each, for a single ray in plain Python.

Microsoft: DirectX Raytracing (DXR) Functional Spec, v1.31, 2025. That compiled shaders do the same
is tested in test_pipeline_programs.py: the functions are the same.
"""

import numpy as np
import pytest
from accelscope.core import kernels
from accelscope.core.errors import InputError
from accelscope.core.geometry.csg.description import Difference
from accelscope.core.geometry.instance_settings import (
    CULL_DISABLE,
    FORCE_NON_OPAQUE,
    FORCE_OPAQUE,
    FRONT_CCW,
)
from accelscope.core.geometry.solids.description import Sphere
from accelscope.core.pipeline.language import (
    ACCEPT_HIT,
    ACCEPT_HIT_AND_END_SEARCH,
    HIT_KIND_TRIANGLE_BACK_FACE,
    HIT_KIND_TRIANGLE_FRONT_FACE,
    IGNORE_HIT,
    RAY_FLAG_ACCEPT_FIRST_HIT_AND_END_SEARCH,
    RAY_FLAG_CULL_BACK_FACING_TRIANGLES,
    RAY_FLAG_CULL_FRONT_FACING_TRIANGLES,
    RAY_FLAG_CULL_NON_OPAQUE,
    RAY_FLAG_CULL_OPAQUE,
    RAY_FLAG_FORCE_NON_OPAQUE,
    RAY_FLAG_FORCE_OPAQUE,
    RAY_FLAG_SKIP_CLOSEST_HIT_SHADER,
    RAY_FLAG_SKIP_PROCEDURAL_PRIMITIVES,
    RAY_FLAG_SKIP_TRIANGLES,
    BuiltInTriangleIntersectionAttributes,
    HitGroup,
    Program,
    RayDesc,
    float3,
    report_hit,
    struct,
    trace_ray,
)
from accelscope.core.pipeline.system import GEOMETRY_FLAG_OPAQUE
from accelscope.core.scene import Scene
from pipeline_scenes import (
    HERE,
    Payload,
    boxes,
    called,
    closest_hit,
    down,
    miss,
    names,
    pipeline,
    placed,
    program,
    stack,
    states,
    tracing,
    triangle,
)

SHADERS = "ray_generation", "intersection", "any_hit", "closest_hit", "miss"


def accept(payload: Payload, attributes, ray):
    payload.value = (ray.t_current, payload.value[1] + 1.0, 0.0)
    return ACCEPT_HIT


def ignore(payload: Payload, attributes, ray):
    payload.value = (payload.value[0], payload.value[1] + 1.0, 0.0)
    return IGNORE_HIT


def end(payload: Payload, attributes, ray):
    return ACCEPT_HIT_AND_END_SEARCH


def shown(scene, made, rays=None, **options):
    """The colour of the one pixel, in plain Python."""
    rays = down() if rays is None else rays
    with kernels.plain(True):
        return pipeline(scene, made, **options).launch(rays, 1, 1, threads=1).colours[0, 0]


# -------------------------------------------------------------------------------- ray extents


@pytest.mark.parametrize(("t_min", "t_max", "is_hit"), [
    (0.0, 7.0, False), (0.0, np.nextafter(7.0, 8), True), (7.0, 9.0, False),
    (np.nextafter(7.0, 6), 9.0, True),
])  # fmt: skip
def test_a_triangle_is_hit_where_t_min_is_less_than_t_and_t_less_than_t_max(t_min, t_max, is_hit):
    found = names(states(stack(3.0), program(t_min=t_min, t_max=t_max)))
    assert ("closest_hit" in found, "miss" in found) == (is_hit, not is_hit)


@struct
class Normal:
    normal: float3


def report_top(ray, attributes: Normal):
    report_hit(ray, 6.5, 7, attributes)


def closest_of_box(payload: Payload, attributes: Normal, ray, scene):
    payload.value = (ray.t_current, attributes.normal[2], 1.0 * ray.hit_kind)


@pytest.mark.parametrize(("t_min", "t_max", "is_hit"), [
    (0.0, 6.5, True), (6.5, 9.0, True), (6.5, 6.5, True), (0.0, np.nextafter(6.5, 6), False),
    (np.nextafter(6.5, 7), 9.0, False),
])  # fmt: skip
def test_a_procedural_primitive_is_hit_where_t_is_between_t_min_and_t_max_or_one_of_them(
    t_min, t_max, is_hit
):
    group = HitGroup(closest_hit=closest_of_box, intersection=report_top)
    found = names(states(boxes(3.0), program(group, t_min=t_min, t_max=t_max)))
    assert ("closest_hit" in found, "miss" in found) == (is_hit, not is_hit)


def test_the_direction_does_not_get_normalized():
    assert shown(stack(3.0), program(), down(length=2.0))[0] == 3.5


@pytest.mark.parametrize("bad", [
    {"t_min": -1.0}, {"t_min": 2.0, "t_max": 1.0}, {"t_max": float("nan")},
])  # fmt: skip
def test_t_min_must_be_nonnegative_and_no_more_than_t_max_and_nothing_may_be_nan(bad):
    with pytest.raises(InputError, match="0 <= t_min <= t_max"):
        states(stack(3.0), program(**bad))


# ------------------------------------------------------------------------- any hit, closest hit


def test_any_hit_shaders_are_all_executed_before_the_closest_hit_shader():
    found = [n for n in names(states(
        stack(1.0, 2.0, 3.0), program(HitGroup(closest_hit=closest_hit, any_hit=ignore)),
    )) if n in SHADERS]  # fmt: skip
    assert found == ["ray_generation", "any_hit", "any_hit", "any_hit", "miss"]
    found = [n for n in names(states(
        stack(1.0, 2.0, 3.0), program(HitGroup(closest_hit=closest_hit, any_hit=accept)),
    )) if n in SHADERS]  # fmt: skip
    assert found[-1] == "closest_hit"
    assert found.count("closest_hit") == 1
    assert 1 <= found.count("any_hit") <= 3


def test_an_ignored_hit_does_not_count_and_its_changes_of_the_payload_stay():
    group = HitGroup(closest_hit=closest_hit, any_hit=ignore)
    colour = shown(stack(1.0, 2.0, 3.0), program(group, misses=()))
    np.testing.assert_array_equal(colour, [0.0, 3.0, 0.0, 1.0])


def test_if_an_any_hit_shader_accepts_a_hit_its_t_becomes_the_new_t_max():
    group = HitGroup(closest_hit=closest_hit, any_hit=accept)
    found = states(stack(3.0, 2.0, 1.0), program(group), structure="naive")
    # Tested in the order of their numbers, which is from near to far: the others lie beyond.
    assert called(found, "any_hit") == [0]
    found = states(stack(1.0, 2.0, 3.0), program(group), structure="naive")
    assert called(found, "any_hit") == [0, 1, 2]
    assert called(found, "closest_hit") == [2]


def test_accept_first_hit_ends_the_search_and_the_closest_so_far_has_its_closest_hit_shader_run():
    group = HitGroup(closest_hit=closest_hit, any_hit=accept)
    flags = RAY_FLAG_ACCEPT_FIRST_HIT_AND_END_SEARCH
    found = states(stack(1.0, 2.0, 3.0), program(group, flags=flags), structure="naive")
    assert called(found, "any_hit") == called(found, "closest_hit") == [0]
    # One that is ignored ends nothing.
    group = HitGroup(closest_hit=closest_hit, any_hit=ignore)
    found = states(stack(1.0, 2.0, 3.0), program(group, flags=flags), structure="naive")
    assert called(found, "any_hit") == [0, 1, 2]


@pytest.mark.parametrize("structure", ["naive", "bvh", "kdtree", "grid", "octree"])
def test_accept_hit_and_end_search_stops_searching_for_more(structure):
    group = HitGroup(closest_hit=closest_hit, any_hit=end)
    found = states(stack(*range(9)), program(group), structure=structure)
    assert len(called(found, "any_hit")) == 1
    assert called(found, "closest_hit") == called(found, "any_hit")


def test_skip_closest_hit_shader_calls_neither_it_nor_a_miss_shader():
    found = names(states(stack(3.0), program(flags=RAY_FLAG_SKIP_CLOSEST_HIT_SHADER)))
    assert [name for name in found if name in SHADERS] == ["ray_generation"]


def test_a_null_shader_calls_nothing():
    found = names(states(stack(3.0), program(HitGroup())))
    assert [name for name in found if name in SHADERS] == ["ray_generation"]
    found = names(states(stack(3.0), program(misses=(None,), t_max=1.0)))
    assert [name for name in found if name in SHADERS] == ["ray_generation"]


# ------------------------------------------------------------------------------------ opaqueness


def asked(flags=0, geometry=0, instance=0):
    """Whether any hit is called for one triangle in an instance."""
    group = HitGroup(closest_hit=closest_hit, any_hit=accept)
    found = states(placed(3.0, flags=instance), program(group, flags=flags), flags=(geometry,))
    assert called(found, "closest_hit") == [0]
    return bool(called(found, "any_hit"))


def test_opaqueness_is_of_geometry_then_of_instance_then_of_the_ray():
    opaque = GEOMETRY_FLAG_OPAQUE
    assert asked()
    assert not asked(geometry=opaque)
    assert asked(geometry=opaque, instance=FORCE_NON_OPAQUE)
    assert not asked(instance=FORCE_OPAQUE)
    assert not asked(RAY_FLAG_FORCE_OPAQUE, instance=FORCE_NON_OPAQUE)
    assert asked(RAY_FLAG_FORCE_NON_OPAQUE, geometry=opaque)
    assert asked(RAY_FLAG_FORCE_NON_OPAQUE, instance=FORCE_OPAQUE)


def met(flags, geometry=0, instance=0, group=None):
    """Whether one triangle in an instance is hit."""
    found = states(placed(3.0, flags=instance), program(
        *([group] if group else []), flags=flags), flags=(geometry,))  # fmt: skip
    return bool(called(found, "closest_hit"))


def test_cull_opaque_culls_what_geometry_and_instance_say_is_opaque():
    assert met(RAY_FLAG_CULL_OPAQUE)
    assert not met(RAY_FLAG_CULL_OPAQUE, geometry=GEOMETRY_FLAG_OPAQUE)
    assert not met(RAY_FLAG_CULL_OPAQUE, instance=FORCE_OPAQUE)
    assert met(RAY_FLAG_CULL_OPAQUE, GEOMETRY_FLAG_OPAQUE, FORCE_NON_OPAQUE)


def test_cull_non_opaque_culls_the_others():
    assert not met(RAY_FLAG_CULL_NON_OPAQUE)
    assert met(RAY_FLAG_CULL_NON_OPAQUE, geometry=GEOMETRY_FLAG_OPAQUE)
    assert not met(RAY_FLAG_CULL_NON_OPAQUE, GEOMETRY_FLAG_OPAQUE, FORCE_NON_OPAQUE)


@pytest.mark.parametrize("flags", [
    RAY_FLAG_FORCE_OPAQUE | RAY_FLAG_FORCE_NON_OPAQUE,
    RAY_FLAG_CULL_OPAQUE | RAY_FLAG_CULL_NON_OPAQUE,
    RAY_FLAG_FORCE_OPAQUE | RAY_FLAG_CULL_OPAQUE,
    RAY_FLAG_CULL_BACK_FACING_TRIANGLES | RAY_FLAG_CULL_FRONT_FACING_TRIANGLES,
    RAY_FLAG_SKIP_TRIANGLES | RAY_FLAG_CULL_BACK_FACING_TRIANGLES,
    RAY_FLAG_SKIP_TRIANGLES | RAY_FLAG_SKIP_PROCEDURAL_PRIMITIVES,
])  # fmt: skip
def test_flags_that_are_mutually_exclusive_are_refused(flags):
    with pytest.raises(InputError, match="exclude each other"):
        states(stack(3.0), program(flags=flags))


# --------------------------------------------------------------------------------------- culling


def test_hit_kind_says_which_face_was_hit():
    assert shown(stack(3.0), program())[2] == HIT_KIND_TRIANGLE_FRONT_FACE
    assert shown(stack(3.0, flipped=True), program())[2] == HIT_KIND_TRIANGLE_BACK_FACE


def test_rays_may_cull_back_or_front_faces_unless_the_instance_disables_it():
    back, front = RAY_FLAG_CULL_BACK_FACING_TRIANGLES, RAY_FLAG_CULL_FRONT_FACING_TRIANGLES
    assert met(back)
    assert not met(front)
    assert met(front, instance=CULL_DISABLE)
    assert not met(back, instance=FRONT_CCW)
    assert met(front, instance=FRONT_CCW)


def test_a_mirroring_matrix_of_an_instance_does_not_change_which_face_is_the_front():
    mirrored = HERE.copy()
    mirrored[0, 0] = -1.0
    scene = placed(matrices=mirrored[None])
    assert shown(scene, program())[2] == HIT_KIND_TRIANGLE_FRONT_FACE


def test_triangles_and_procedural_primitives_may_be_skipped():
    assert not met(RAY_FLAG_SKIP_TRIANGLES)
    assert met(RAY_FLAG_SKIP_PROCEDURAL_PRIMITIVES)
    group = HitGroup(closest_hit=closest_of_box, intersection=report_top)
    for flags, calls in ((0, 1), (RAY_FLAG_SKIP_TRIANGLES, 1),
                         (RAY_FLAG_SKIP_PROCEDURAL_PRIMITIVES, 0)):  # fmt: skip
        found = states(boxes(3.0), program(group, flags=flags))
        assert len(called(found, "intersection")) == calls


# ----------------------------------------------------------------------------------------- masks


@pytest.mark.parametrize(("mask", "hit"), [(0xFF, 1), (1, 0), (2, 1), (4, None), (0, None)])
def test_an_instance_is_ignored_if_its_mask_and_that_of_the_ray_have_no_bit_in_common(mask, hit):
    scene = placed(1.0, 2.0, 3.0, masks=np.array([1, 2, 0]))
    found = states(scene, program(mask=mask))
    assert called(found, "closest_hit") == ([] if hit is None else [hit])


def test_only_the_eight_lowest_bits_of_the_mask_count():
    assert called(states(placed(1.0), program(mask=0x100)), "miss") == [-1]


# --------------------------------------------------------------------------------- shader tables


def closest_of(number):
    def shader(payload: Payload, attributes, ray, scene):
        payload.value = (1.0 * number, 0.0, 0.0)

    return HitGroup(closest_hit=shader)


@pytest.mark.parametrize(("contribution", "multiplier", "expected"), [
    (0, 0, 0), (1, 0, 1), (0, 1, 2), (0, 2, 4), (1, 2, 5),
])  # fmt: skip
def test_the_hit_group_is_that_of_contribution_plus_multiplier_times_geometry_index(
    contribution, multiplier, expected
):
    groups = [closest_of(number) for number in range(6)]
    made = program(*groups, contribution=contribution, multiplier=multiplier)
    # The nearest triangle is of geometry 2.
    assert shown(stack(1.0, 2.0, 3.0), made)[0] == expected


def test_the_instance_contributes_to_the_index_of_the_hit_group():
    groups = [closest_of(number) for number in range(6)]
    scene = placed(1.0, 2.0, hit_groups=np.array([1, 3]))
    assert shown(scene, program(*groups, contribution=1))[0] == 4.0
    # That of the instance that was hit, not of the last one that was looked into.
    scene = placed(2.0, 1.0, hit_groups=np.array([3, 1]))
    assert shown(scene, program(*groups, contribution=1), structure="naive")[0] == 4.0


def test_the_any_hit_shader_is_that_of_the_same_hit_group():
    def ignores(payload: Payload, attributes, ray):
        return IGNORE_HIT

    groups = [HitGroup(closest_hit=closest_hit, any_hit=each) for each in (accept, ignores)]
    # Of three geometries the middle one has group 1, and so has the second instance.
    found = states(stack(1.0, 2.0, 3.0), program(*groups), structure="naive")
    assert called(found, "ignored") == [1]
    found = states(placed(1.0, 2.0, hit_groups=np.array([0, 1])), program(*groups))
    assert (called(found, "ignored"), called(found, "closest_hit")) == ([1], [0])


def test_the_table_repeats_the_hit_groups_of_the_program():
    assert shown(placed(1.0, hit_groups=7), program(closest_of(0), closest_of(1)))[0] == 1.0


def other_miss(payload: Payload, ray, scene):
    payload.value = (5.0, ray.t_current, 0.0)


def test_the_miss_shader_is_the_one_of_its_index():
    made = program(misses=(miss, other_miss), miss=1, t_max=2.0)
    np.testing.assert_array_equal(shown(stack(3.0), made)[:2], [5.0, 2.0])


def test_an_index_of_no_miss_shader_is_refused():
    with pytest.raises(InputError, match="does not have"):
        states(stack(3.0), program(miss=1))


# ------------------------------------------------------------------------------------- recursion


@struct
class Depth:
    deepest: int


def recursive(limit):
    def ray_generation(scene, launch, output):
        ray = RayDesc()
        ray.origin, ray.direction = launch.camera_position, launch.camera_direction
        ray.t_max = 1e30
        payload = Depth()
        trace_ray(scene, 0, 0xFF, 0, 0, 0, ray, payload)
        output.color = (1.0 * payload.deepest, 0.0, 0.0, 1.0)

    def closest(payload: Depth, attributes, ray, scene):
        if payload.deepest + 1 < limit:
            again = RayDesc()
            again.origin, again.direction = ray.world_origin, ray.world_direction
            again.t_max = 1e30
            below = Depth()
            below.deepest = payload.deepest + 1
            trace_ray(scene, 0, 0xFF, 0, 0, 0, again, below)
            payload.deepest = below.deepest

    return Program(ray_generation, [HitGroup(closest_hit=closest)], [None], 31)


def test_closest_hit_shaders_may_trace_rays_31_deep():
    assert shown(stack(3.0), recursive(31))[0] == 30.0


def test_at_the_declared_depth_another_ray_is_an_error():
    with pytest.raises(InputError, match="deeper than the program declares"):
        shown(stack(3.0), recursive(32))
    with pytest.raises(InputError, match="from 1 to 31"):
        program(depth=32)


def test_a_shader_may_trace_any_number_of_rays_below_the_declared_depth():
    def ray_generation(scene, launch, output):
        ray = RayDesc()
        ray.origin, ray.direction = launch.camera_position, launch.camera_direction
        total = 0.0
        for number in range(5):
            ray.t_max = 1e30
            ray.t_min = 1.0 * number
            payload = Payload()
            trace_ray(scene, 0, 0xFF, 0, 1, 0, ray, payload)
            total += payload.value[0]
        output.color = (total, 0.0, 0.0, 1.0)

    made = Program(ray_generation, [HitGroup(closest_hit=closest_hit)], [miss])
    assert shown(stack(3.0), made)[0] == 5.0 * 7.0


def test_a_miss_shader_may_trace_rays():
    def miss_again(payload: Payload, ray, scene):
        if ray.t_current < 5.0:
            again = RayDesc()
            again.origin, again.direction = ray.world_origin, ray.world_direction
            again.t_max = 1e30
            trace_ray(scene, 0, 0xFF, 0, 0, 0, again, payload)

    made = program(misses=(miss_again,), depth=2, t_max=2.0)
    assert shown(stack(3.0), made)[0] == 7.0


def test_system_values_of_a_ray_are_its_own_again_when_one_below_it_has_returned():
    def closest(payload: Payload, attributes, ray, scene):
        t = ray.t_current
        if payload.value[2] == 0.0:
            again = RayDesc()
            again.origin, again.direction = ray.world_origin, ray.world_direction
            again.t_min, again.t_max = ray.t_current, 1e30
            below = Payload()
            below.value = (0.0, 0.0, 1.0)
            trace_ray(scene, 0, 0xFF, 0, 0, 0, again, below)
            payload.value = (t, ray.t_current, below.value[0])
        else:
            payload.value = (t, 0.0, 0.0)

    made = program(HitGroup(closest_hit=closest), depth=2)
    np.testing.assert_array_equal(shown(stack(2.0, 3.0), made)[:3], [7.0, 7.0, 8.0])


# --------------------------------------------------------------------------------- intersection


def report_three(ray, attributes: Normal):
    attributes.normal = (0.0, 0.0, 2.0)
    first = report_hit(ray, 7.2, 1, attributes)
    attributes.normal = (0.0, 0.0, 3.0)
    second = report_hit(ray, 6.9, 2, attributes)
    attributes.normal = (0.0, 0.0, 4.0)
    third = report_hit(ray, 7.1, 3, attributes)
    assert (first, second, third) == (True, True, False)
    assert ray.t_current == 6.9


def test_an_intersection_shader_may_report_several_hits_and_is_told_which_count():
    group = HitGroup(closest_hit=closest_of_box, intersection=report_three)
    np.testing.assert_array_equal(shown(boxes(3.0), program(group))[:3], [6.9, 3.0, 2.0])


def test_no_hit_is_reported_without_report_hit():
    def silent(ray, attributes: Normal):
        pass

    found = states(boxes(3.0), program(HitGroup(closest_hit=closest_of_box, intersection=silent)))
    assert called(found, "intersection") == [0]
    assert called(found, "miss") == [-1]


def test_any_hit_is_asked_for_hits_of_procedural_primitives_too():
    def ignore_first(payload: Payload, attributes: Normal, ray):
        return IGNORE_HIT if ray.hit_kind == 2 else ACCEPT_HIT

    def report_two(ray, attributes: Normal):
        assert report_hit(ray, 7.2, 1, attributes)
        assert not report_hit(ray, 6.9, 2, attributes)

    group = HitGroup(closest_hit=closest_of_box, any_hit=ignore_first, intersection=report_two)
    assert shown(boxes(3.0), program(group))[0] == 7.2


def test_hits_of_one_primitive_are_no_matter_of_the_one_before():
    def report_entry(ray, attributes: Normal):
        report_hit(ray, ray.world_origin[2] - ray.box[5], 0, attributes)

    def ignore_first(payload: Payload, attributes: Normal, ray):
        return IGNORE_HIT if ray.primitive_index == 0 else ACCEPT_HIT

    group = HitGroup(closest_of_box, ignore_first, report_entry)
    assert shown(boxes(3.0, 1.0), program(group), structure="naive")[0] == 8.5


# --------------------------------------------------------------------------------- system values


def test_barycentrics_are_the_weights_of_the_second_and_third_corner():
    def closest(payload: Payload, attr: BuiltInTriangleIntersectionAttributes, ray, scene):
        payload.value = (attr.barycentrics[0], attr.barycentrics[1], 0.0)

    u, v, _, _ = shown(stack(3.0), program(HitGroup(closest_hit=closest)))
    corners = triangle(3.0)
    point = corners[0] + u * (corners[1] - corners[0]) + v * (corners[2] - corners[0])
    np.testing.assert_allclose(point, [0.25, 0.5, 3.0], rtol=0, atol=1e-14)


def test_instance_index_and_id_and_matrices_are_those_of_the_instance():
    seen = []

    def closest(payload: Payload, attributes, ray, scene):
        seen.append((
            ray.instance_index, ray.instance_id, ray.object_origin, ray.object_direction,
            ray.object_to_world, ray.world_to_object, ray.vertices, ray.primitive_index,
        ))  # fmt: skip

    matrix = np.array([[2.0, 0, 0, 0], [0, 2.0, 0, 0], [0, 0, 2.0, 3.0]])
    scene = placed(matrices=np.array([HERE, matrix]), instance_ids=np.array([7, 9]))
    shown(scene, program(HitGroup(closest_hit=closest)))
    ((index, number, origin, direction, to_world, to_object, vertices, primitive),) = seen
    assert (index, number, primitive) == (1, 9, 0)
    np.testing.assert_array_equal(origin, [0.125, 0.25, 3.5])
    np.testing.assert_array_equal(direction, [0.0, 0.0, -0.5])
    np.testing.assert_array_equal(np.reshape(to_world, (3, 4)), matrix)
    np.testing.assert_allclose(
        np.reshape(to_object, (3, 4))[:, :3] @ matrix[:, :3], np.eye(3), atol=1e-15
    )
    np.testing.assert_array_equal(np.reshape(vertices, (3, 3)), triangle(0.0))


def test_primitive_index_counts_within_the_geometry():
    corners = np.array([triangle(1.0), triangle(2.0), triangle(3.0)])
    scene = Scene.from_triangles(
        corners, "two", object_ids=np.array([0, 1, 1]), object_names=("one", "two")
    )
    assert shown(scene, program())[1] == 1.0


def test_t_current_of_any_hit_is_that_of_the_candidate_and_of_miss_the_end_of_the_ray():
    group = HitGroup(any_hit=accept)
    found = shown(stack(3.0), program(group))
    assert found[0] == 7.0
    assert shown(stack(3.0), program(t_max=4.0))[2] == 4.0


def test_what_is_given_to_shaders_can_only_be_read():
    def wrong(payload: Payload, attributes, ray, scene):
        ray.t_current = 1.0

    with pytest.raises(InputError, match="can only be read"):
        states(stack(3.0), program(HitGroup(closest_hit=wrong)))


# ---------------------------------------------------------------------------------- bad programs


def test_a_payload_of_another_struct_than_the_shader_takes_is_refused():
    def other(payload: Normal, attributes, ray, scene):
        pass

    with pytest.raises(InputError, match="another struct"):
        states(stack(3.0), program(HitGroup(closest_hit=other)))


def test_an_any_hit_shader_must_say_what_becomes_of_the_hit():
    def forgets(payload: Payload, attributes, ray):
        pass

    with pytest.raises(InputError, match="forgets must return ACCEPT_HIT"):
        states(stack(3.0), program(HitGroup(any_hit=forgets)))


def test_a_shader_with_other_parameters_than_its_stage_is_refused():
    def wrong(payload: Payload, scene):
        pass

    with pytest.raises(InputError, match=r"wrong takes \(payload, scene\), but .* closest_hit\("):
        pipeline(stack(3.0), program(HitGroup(closest_hit=wrong)))


def test_a_payload_without_a_struct_is_refused():
    def wrong(payload, attributes, ray, scene):
        pass

    with pytest.raises(InputError, match="say of which struct payload is"):
        pipeline(stack(3.0), program(HitGroup(closest_hit=wrong)))


def test_procedural_primitives_need_an_intersection_shader():
    with pytest.raises(InputError, match="no hit group with an intersection shader"):
        pipeline(boxes(3.0), program())


def test_structures_that_do_not_answer_every_ray_are_refused():
    with pytest.raises(InputError, match="lazy"):
        pipeline(stack(1.0, 2.0), Program(tracing()), structure="grid", lazy=True)


def test_solids_made_of_others_are_refused():
    ball, cut = Sphere((0.0, 0.0, 0.0), 1.0), Sphere((0.5, 0.0, 0.0), 1.0)
    with pytest.raises(InputError, match="made of others"):
        pipeline(Scene.from_trees([Difference([ball, cut])], "cut"), program())
