"""A cell that begins like a number and goes on as a formula does not become one."""

import pytest
from accelscope.core.evaluation.records.report import no_formula

FORMULAS = [
    "-1 +cmd|'/c calc'!A1", "+1 =1+1", "-1 -A1", "-1 2 @SUM(A1)", "-1\t=1", "-1 ", "-1  2",
    "-inf", "+nan", "-Infinity 1", "-1_000", "-1 2;3", "\uff1d1+1", "\uff0bA1", "-\uff11",
]  # fmt: skip
NUMBERS = ["-1", "+1", "-1.5", "-.5", "-5.", "-1e5", "-1E-05 +2 3.25", "-1.0 2.0 -3e-05"]


@pytest.mark.parametrize("text", FORMULAS)
def test_formulas_get_an_apostrophe(text):
    assert no_formula(text) == f"'{text}"


@pytest.mark.parametrize("text", NUMBERS)
def test_numbers_stay(text):
    assert no_formula(text) == text
    assert all(float(word) == float(word) for word in text.split(" "))
