"""How a linear model answers: over frequency, to a step and from train to train, beside closed forms."""

import dataclasses

import numpy as np
import pytest
from railcosim.orchestrator.linearization.responses import (
    FrequencyResponse,
    default_duration,
    default_frequencies,
    default_input,
    step_response,
    string_stability,
)

# ---------------------------------------------------------------- responses


def test_frequency_and_step_response_of_a_first_order_lag(a_model):
    model = a_model([[-0.5]], [0.5], [1.0])
    w = np.array([0.1, 0.5, 3.0])
    assert FrequencyResponse(model)(w, 0)[0] == pytest.approx(0.5 / (1j * w + 0.5), rel=1e-12)
    t, y = step_response(model, 0, 10.0)
    assert y[0] == pytest.approx(1.0 - np.exp(-0.5 * t), abs=1e-12)
    half = dataclasses.replace(model, a=np.array([[np.exp(-0.5)]]), b=np.array([[1.0 - np.exp(-0.5)]]), step=1.0)
    t, y = step_response(half, 0, 10.0)
    assert y[0] == pytest.approx(1.0 - np.exp(-0.5 * t), abs=1e-12)


@pytest.mark.parametrize(("zeta", "holds"), [(0.9, True), (0.3, False)])
def test_string_stability_finds_the_resonance(zeta, holds, a_model):
    """Train 2 follows train 1 as w^2 / (s^2 + 2 zeta w s + w^2): peak 1/(2 zeta sqrt(1 - zeta^2)) where it has one."""
    w = 0.5
    a = [[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [w * w, -w * w, -2.0 * zeta * w]]
    outputs = ("train[1].speed", "train[2].speed")
    (passing,) = string_stability(a_model(a, [1, 0, 0], [[1, 0, 0], [0, 1, 0]], outputs=outputs))
    assert (passing.quantity, passing.pair, passing.holds) == ("train speed", "2 to 1", holds)
    if holds:
        assert passing.peak == pytest.approx(1.0, abs=1e-3)  # towards frequency 0
    else:
        assert passing.peak == pytest.approx(1.0 / (2.0 * zeta * np.sqrt(1.0 - zeta**2)), rel=1e-6)
        assert passing.at == pytest.approx(w * np.sqrt(1.0 - 2.0 * zeta**2), rel=1e-3)


def test_trains_that_the_input_does_not_reach_are_left_out(a_model):
    a = np.diag([-1.0, -2.0, -3.0])
    outputs = [f"train[{i}].speed" for i in (1, 2, 3)]
    assert string_stability(a_model(a, [1, 0, 0], np.eye(3), outputs=outputs)) == []


def test_a_sampled_response_is_taken_on_the_unit_circle(a_model):
    """y = 0.5 y + 0.5 u a step ago: 0.5 / (z - 0.5), which is -1/3 at half the sampling frequency."""
    model = a_model([[0.5]], [0.5], [1.0], step=0.2)
    response = FrequencyResponse(model)(np.array([0.0, np.pi / 0.2]), 0)[0]
    assert response == pytest.approx([1.0, -1.0 / 3.0], abs=1e-12)


def test_without_states_the_response_is_the_feed_through(a_model):
    model = a_model(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)))
    model = dataclasses.replace(model, d=np.array([[2.5]]))
    assert FrequencyResponse(model)(np.array([0.1, 1.0]), 0).tolist() == [[2.5, 2.5]]


def test_frequencies_are_around_the_modes_and_below_half_of_the_samples(a_model):
    continuous = default_frequencies(a_model(np.diag([-0.1, -2.0]), [1, 1], np.eye(2)))
    assert (continuous[0], continuous[-1]) == pytest.approx((0.003, 20.0))
    assert len(continuous) == 500
    sampled = default_frequencies(a_model([[np.exp(-0.1)]], [1], [1], step=0.1))
    assert sampled[-1] == pytest.approx(10.0)
    assert default_frequencies(a_model([[np.exp(-1.0)]], [1], [1], step=0.5))[-1] == pytest.approx(np.pi / 0.5)
    stiff = default_frequencies(a_model(np.diag([-1e-6, -1e6]), [1, 1], np.eye(2)))
    assert (stiff[0], stiff[-1]) == pytest.approx((1.0, 1e7)), "seven decades"
    assert default_frequencies(a_model([[0.0]], [1], [1]))[-1] == pytest.approx(10.0), "nothing moves by itself"


def test_a_step_response_lasts_five_of_the_time_constants_worth_waiting_for(a_model):
    assert default_duration(a_model(np.diag([-0.1, -2.0]), [1, 1], np.eye(2))) == pytest.approx(50.0)
    day = a_model(np.diag([-1e-5, -1.0, -1.0]), [1, 1, 1], np.eye(3))
    assert default_duration(day) == pytest.approx(5.0), "what creeps for a day is left out"
    assert default_duration(a_model([[0.0]], [1], [1])) == 100.0
    assert default_duration(a_model([[1.0]], [1], [1], step=0.1)) == pytest.approx(100.0)


def test_strings_are_judged_under_the_first_disturbance(a_model):
    model = a_model(-np.eye(2), np.eye(2), np.eye(2))
    assert default_input(dataclasses.replace(model, inputs=("a.target", "train[1].disturbance[1]"))) == 1
    assert default_input(dataclasses.replace(model, inputs=("a.target", "train[1].disturbance[2]"))) == 0


def test_gaps_are_judged_beside_each_other(a_model):
    """Three trains at -x' = x, each drawn by the one ahead: the gaps go as 1 / (s + 1) of each other."""
    a = [[-1.0, 0.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, -1.0]]
    outputs = [f"train[{i}].position" for i in (1, 2, 3)]
    (passing,) = string_stability(a_model(a, [1, 0, 0], np.eye(3), outputs=outputs))
    assert (passing.quantity, passing.pair, passing.holds) == ("train gap", "2–3 to 1–2", True)
    assert passing.size == pytest.approx(1.0 / np.sqrt(1.0 + passing.frequencies**2), rel=1e-9)


def test_trains_that_do_not_follow_each_other_are_no_string(a_model):
    outputs = ["train[1].speed", "train[3].speed"]
    assert string_stability(a_model([[-1.0, 0.0], [1.0, -1.0]], [1, 0], np.eye(2), outputs=outputs)) == []


def test_without_inputs_there_is_nothing_to_pass_on(a_model):
    model = dataclasses.replace(a_model([[-1.0]], [1], [1]), inputs=())
    assert string_stability(model) == []
