"""Which metrics are better small and which large, and who wins."""

import math

import pytest
from railcosim.orchestrator.comparison.preference import better, read_directions, winners
from railcosim.orchestrator.errors import ScenarioError


@pytest.mark.parametrize(
    ("expression", "direction"),
    [
        ("settling_time(a.x)", "smaller"),
        ("rms(a.x - b.x)", "smaller"),
        ("max(abs(a.x))", "smaller"),
        ("mean(abs(a.x - b.x))", "smaller"),
        ("final(ato.speed_error)", "smaller"),
        ("integral(ato[2].position_error)", "smaller"),
        ("min(train[1].position - train[2].position)", "larger"),
        ("min(train[1].position - train[2].position - 25)", "larger"),
        ("min(a.gap)", "larger"),
        ("min(protection.braking_margin)", "larger"),
        ("min(train[1].speed - train[2].speed)", "none"),
        ("max(a.x)", "none"),
        ("min(a.x)", "none"),
        ("final(a.x)", "none"),
    ],
)
def test_the_direction_is_that_of_the_outermost_reducer(expression, direction):
    assert better(expression) == direction


@pytest.mark.parametrize(
    ("expression", "direction"),
    [
        ("rms(a.x) * 3.6", "smaller"),
        ("rms(a.x) / 1000", "smaller"),
        ("rms(a.x) + 5", "smaller"),
        ("rms(a.x) - 5", "smaller"),
        ("rms(a.x) / 0.5 - 1", "smaller"),
        ("-rms(a.x)", "larger"),
        ("-min(a.gap)", "smaller"),
        ("-max(a.x)", "none"),
        ("rms(a.x) * 0", "none"),
        ("rms(a.x) - rms(b.x)", "none"),
        ("rms(a.x) / rms(b.x)", "none"),
        ("3.5", "none"),
        ("this is no expression", "none"),
        ("rms(", "none"),
    ],
)
def test_numbers_keep_it_or_turn_it_round(expression, direction):
    assert better(expression) == direction


@pytest.mark.parametrize(
    ("values", "direction", "best"),
    [
        ([3.0, 1.0, 2.0], "smaller", (1,)),
        ([3.0, 1.0, 2.0], "larger", (0,)),
        ([3.0, 1.0, 2.0], "none", ()),
        ([1.0, 2.0, 1.0 + 1e-12], "smaller", (0, 2)),
        ([1.0, 1.0 + 1e-12], "smaller", ()),
        ([1.0, 1.0 + 1e-6], "smaller", (0,)),
        ([math.nan, 2.0, 3.0], "larger", (2,)),
        ([math.nan, 2.0], "larger", ()),
        ([math.nan, math.nan], "smaller", ()),
        ([math.inf, 5.0], "smaller", (1,)),
        ([math.inf, 5.0], "larger", (0,)),
        ([math.inf, math.inf, 1.0], "larger", (0, 1)),
        ([-0.0, 0.0, 1.0], "smaller", (0, 1)),
        ([], "smaller", ()),
        ([1.0], "smaller", ()),
    ],
)
def test_winners(values, direction, best):
    assert winners(values, direction) == best


def test_directions_may_be_given():
    metrics = {"settling": "settling_time(a.x)", "end": "final(a.x)"}
    assert read_directions(["settling=none", "end = larger"], metrics) == {"settling": "none", "end": "larger"}
    assert read_directions([], metrics) == {}


def test_wrong_directions_are_told_all_at_once():
    with pytest.raises(ScenarioError) as caught:
        read_directions(["end=best", "settlin=smaller", "end"], {"settling": "", "end": ""})
    assert str(caught.value).splitlines() == [
        "--better end=best: write METRIC=smaller, METRIC=larger or METRIC=none",
        "--better settlin=smaller: there is no metric 'settlin'; did you mean 'settling'?",
        "--better end: write METRIC=smaller, METRIC=larger or METRIC=none",
    ]


@pytest.mark.parametrize(
    ("values", "barred", "best"),
    [
        ([3.0, 1.0, 2.0], [1], (2,)),
        ([1.0, 1.0, 2.0], [0], (1,)),
        ([1.0, 2.0], [0], (1,)),
        ([1.0, 1.0], [0], (1,)),
        ([1.0, 2.0], [0, 1], ()),
        ([1.0, math.nan], [0], ()),
    ],
)
def test_who_is_barred_wins_nothing(values, barred, best):
    assert winners(values, "smaller", barred) == best
