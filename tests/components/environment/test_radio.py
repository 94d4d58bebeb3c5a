"""The radio link against a list of messages kept by hand, and its statistics against the chain's own."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from railcosim.components import ComponentError, RadioLink, Simulation
from railcosim.components.noise import uniform

STEP = 0.1


def sender(t):
    return 1e3 + 70.0 * t, 70.0 + math.sin(t)


def listen(radio, count=200, step=STEP):
    """What is received at each sample: (n, 3) of position, speed, age, as a controller beside it reads them."""
    simulation = Simulation(radio)
    simulation.initialize()
    rows = []
    for k in range(count):
        simulation.time = k * step
        position, speed = sender(k * step)
        simulation.set("sent_position", position)
        simulation.set("sent_speed", speed)
        if k == 0:
            simulation.start()
        simulation.step(step)
        rows.append([simulation.get(name) for name in ("position", "speed", "age")])
    return np.array(rows), simulation


def by_hand(
    count, *, seed=0, refresh=STEP, delay=0.0, jitter=0.0, loss=0.0, begin=0.0, end=0.5, burst_loss=1.0, outages=()
):
    """All messages in a list; at each sample the newest of those that have arrived."""
    messages, rows, bad, last = [(0.0, 0.0)], [], False, -1
    for k in range(count):
        t = k * STEP
        number = math.floor(t / refresh + 1e-6)
        if number > last:
            last = number
            luck, weather, haste = (uniform(seed, stream, number) for stream in range(3))
            bad = not weather < end if bad else weather < begin
            lost = luck < (burst_loss if bad else loss) or any(a <= t + 1e-6 < b for a, b in outages)
            if not lost:
                messages.append((t, t + delay + jitter * haste))
        sent = max(stamp for stamp, arrival in messages if arrival <= t + 1e-6)
        rows.append([*sender(sent), t - sent])
    return np.array(rows)


def test_a_perfect_link_is_a_wire():
    rows, _ = listen(RadioLink())
    assert [tuple(row[:2]) for row in rows] == [sender(k * STEP) for k in range(200)]
    assert (rows[:, 2] == 0.0).all()


@pytest.mark.parametrize(
    "changes",
    [
        {"delay": 0.5},
        {"delay": 0.25},
        {"refresh": 1.0},
        {"refresh": 0.7, "delay": 0.3},
        {"loss": 0.3},
        {"jitter": 0.8},
        {"delay": 0.2, "jitter": 0.4, "loss": 0.2, "begin": 0.1, "end": 0.3, "burst_loss": 0.9},
        {"outages": [[3.0, 5.0], [7.05, 7.5]]},
    ],
)
def test_against_messages_kept_by_hand(changes):
    names = {"begin": "burst_begin", "end": "burst_end"}
    rows, _ = listen(RadioLink(seed=7, **{names.get(name, name): value for name, value in changes.items()}))
    assert rows == pytest.approx(by_hand(200, seed=7, **changes), abs=1e-9)


@settings(max_examples=10, deadline=None)
@given(
    st.fixed_dictionaries(
        {
            "seed": st.integers(0, 1000),
            "delay": st.floats(0.0, 0.7),
            "jitter": st.floats(0.0, 0.5),
            "loss": st.floats(0.0, 1.0),
            "refresh": st.sampled_from([0.1, 0.2, 0.5, 1.0]),
        }
    ),
    st.floats(0.0, 0.5),
    st.floats(0.05, 1.0),
)
def test_any_link_against_messages_kept_by_hand(values, begin, end):
    rows, simulation = listen(RadioLink(**values, burst_begin=begin, burst_end=end), count=120)
    assert rows == pytest.approx(by_hand(120, **values, begin=begin, end=end), abs=1e-9)
    assert simulation.get("overrun") is False


def test_an_outage_may_be_a_parameter():
    rows, _ = listen(RadioLink(outage_begin=3.0, outage_end=5.0))
    assert (rows == listen(RadioLink(outages=[[3.0, 5.0]]))[0]).all()


def test_the_same_seed_gives_the_same_losses_and_another_one_others():
    first, second, other = (listen(RadioLink(seed=seed, loss=0.5))[0] for seed in (1, 1, 2))
    assert (first == second).all()
    assert (first != other).any()


def test_independent_losses_have_their_rate():
    """600 messages at 20 %: a standard deviation of 1.6 %."""
    rows, _ = listen(RadioLink(seed=3, loss=0.2), count=600)
    assert (rows[:, 2] > 0.0).mean() == pytest.approx(0.2, abs=0.05)


@pytest.mark.long
def test_bursts_have_the_length_and_share_of_the_chain():
    """Share p / (p + r) = 1/6, mean length 1 / r = 10 messages."""
    rows, _ = listen(RadioLink(seed=3, burst_begin=0.02, burst_end=0.1), count=4000)
    lost = rows[:, 2] > 0.0
    begins = np.flatnonzero(lost[1:] & ~lost[:-1])
    assert lost.mean() == pytest.approx(1.0 / 6.0, abs=0.05)
    assert lost.sum() / len(begins) == pytest.approx(10.0, abs=3.0)


def test_nothing_is_sent_while_the_sender_is_silent():
    simulation = Simulation(RadioLink(sent_position=5.0, sending=False))
    simulation.initialize()
    simulation.start()
    simulation.set("sent_position", 9.0)
    for _ in range(10):
        simulation.step(STEP)
    assert simulation.get("position") == 5.0
    assert simulation.get("age") == pytest.approx(0.9, abs=1e-9)


def test_what_is_true_at_the_start_is_known_at_the_start():
    simulation = Simulation(RadioLink(delay=2.0))
    simulation.initialize(10.0)
    simulation.set("sent_position", 123.0)
    simulation.start()
    assert (simulation.get("position"), simulation.get("age")) == (123.0, 0.0)


def test_a_ring_that_is_too_small_says_so():
    _, simulation = listen(RadioLink(messages=3, delay=1.0), count=20)
    assert simulation.get("overrun") is True
    _, simulation = listen(RadioLink(messages=10, delay=1.0), count=20)
    assert simulation.get("overrun") is False


def test_position_speed_and_age_belong_together():
    """All three depend directly on inputs, so that a controller beside it reads them of one sample."""
    from railcosim.components.tracing import feedthrough

    direct = feedthrough(RadioLink())
    assert all(direct[name] for name in ("position", "speed", "age"))


@pytest.mark.parametrize("outages", ["soon", 3, [[1.0]], [[2.0, 1.0]], [[0.0, "x"]], [[True, 2.0]]])
def test_unusable_outages_are_refused(outages):
    with pytest.raises(ComponentError, match="outages"):
        RadioLink(outages=outages)


def test_interference_loses_a_share_of_what_would_arrive():
    """With loss p and interference q, p + q (1 - p) of the messages: here those whose luck is below 0.6."""
    rows, _ = listen(RadioLink(loss=0.2, interference=0.5))
    assert rows == pytest.approx(by_hand(200, loss=0.6))
    rows, _ = listen(RadioLink(interference=1.0))
    assert (rows[:, 0] == sender(0.0)[0]).all()


def test_further_numbers_come_in_the_message_of_their_moment():
    """Those that stand still beside those of the position: each is the position times its number, whenever heard."""
    radio = Simulation(RadioLink(values=3, unit="m", messages=4, delay=0.25, jitter=0.1, loss=0.3, seed=5))
    radio.set("sent_values", [1e3, 2e3, 3e3])
    radio.set("sent_position", 1e3)
    radio.initialize()
    radio.start()
    heard = []
    for k in range(60):
        position = 1e3 + 7.0 * k
        radio.set("sent_position", position)
        radio.set("sent_values", [n * position for n in (1.0, 2.0, 3.0)])
        radio.step(STEP)
        heard.append(radio.get("position"))
        assert radio.get("heard_values").tolist() == [n * heard[-1] for n in (1.0, 2.0, 3.0)]
    assert len(set(heard)) > 20
