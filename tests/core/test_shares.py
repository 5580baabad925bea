"""A normal run takes a share of the combinations, but every setting in every test."""

import collections

import pytest


@pytest.mark.parametrize("partners", range(1, 25))
def test_no_setting_is_left_out_and_none_takes_more_than_its_share(lab, partners):
    variants = range(len(lab.ALL_VARIANTS))
    taken = [(v, p) for v in variants for p in range(partners) if lab.takes_part(v, p, partners)]
    by_variant = collections.Counter(v for v, _ in taken)
    assert set(by_variant) == set(variants)
    assert max(by_variant.values()) <= -(-partners // min(lab.SHARE, partners))
    # Nor is any of the partners.
    assert {p for _, p in taken} == set(range(partners))


def test_neighbours_go_with_others(lab):
    partners = 2 * lab.SHARE
    assert not any(
        lab.takes_part(variant, partner, partners)
        and lab.takes_part(variant + 1, partner, partners)
        for variant in range(20)
        for partner in range(partners)
    )


def test_the_settings_do_not_shrink(lab):
    """One at least of every choice and switch there is, and the defaults of every structure."""
    found = set(lab.ALL_VARIANTS)
    for name, structure in lab.general_structures().items():
        assert (name, "") in found
        for field in structure.Settings.__dataclass_fields__.values():
            key = lab.key_of(field)
            for choice in lab.choices_of(field):
                assert choice == field.default or (name, f"{key}={choice}") in found
    assert len(found) == len(lab.ALL_VARIANTS) >= 110
