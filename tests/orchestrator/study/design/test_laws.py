"""Distributions: their quantiles against what is known of them, and what is said about wrong ones."""

import math

import numpy as np
import pytest
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.study.design import LAWS, Law
from railcosim.orchestrator.study.design.sampling import kept_inside

NORMAL = 1.959963984540054
"""The 97.5 % quantile of a standard normal distribution, as tables have it."""


@pytest.mark.parametrize(
    ("text", "share", "value"),
    [
        ("uniform(2, 6)", 0.25, 3.0),
        ("loguniform(1e-3, 10)", 0.5, 0.1),
        ("normal(400e3, 20e3)", 0.975, 400e3 + NORMAL * 20e3),
        ("normal(0,1)", 0.5, 0.0),
        ("triangular(0, 0, 2)", 0.75, 1.0),
        ("triangular(0, 1, 2)", 0.125, 0.5),
        ("truncnormal(5, 2, -inf, inf)", 0.975, 5 + NORMAL * 2),
        ("truncnormal(0, 1, 0, inf)", 0.95, NORMAL),
        ("integers(1, 6)", 0.5, 3),
        ("integers(1, 6)", 0.51, 4),
    ],
)
def test_quantiles(text, share, value):
    (drawn,) = Law.read(text).at(np.array([share])).tolist()
    assert drawn == pytest.approx(value, rel=1e-12, abs=1e-15)
    assert type(drawn) is type(value)


def test_whole_numbers_are_all_as_likely():
    shares = (np.arange(6000) + 0.5) / 6000
    assert np.unique(Law.read("integers(-2, 3)").at(shares), return_counts=True)[1].tolist() == [1000] * 6


@pytest.mark.parametrize("name", LAWS)
def test_every_law_is_within_its_bounds_at_the_ends_and_reads_as_it_is_written(name):
    numbers = {"triangular": (0.1, 0.2, 0.4), "truncnormal": (0.1, 0.3, -0.1, math.inf), "integers": (-3.0, 2.0**40)}
    law = Law(name, numbers.get(name, (0.1, 0.7)))
    assert Law.read(str(law)) == law
    assert np.isfinite(law.at(kept_inside(np.array([0.0, 1.0])))).all()


@pytest.mark.parametrize("text", ["i > 1", "ComfortCruise", "a(b", "max(i, min(1, 2))", "3"])
def test_what_is_no_law(text):
    assert Law.read(text) is None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("norml(1, 2)", "there is no distribution 'norml'; did you mean 'normal'?"),
        ("cauchy(1, 2)", "there is no distribution 'cauchy'; there are uniform, loguniform, normal, triangular, "),
        ("normal(1)", "has 1 of 2 numbers; write normal(mean, sd)"),
        ("uniform(1, 2, 3)", "has 3 of 2 numbers; write uniform(low, high)"),
        ("normal(1, x)", "'x' is no number; quote a text that is no distribution"),
        ("normal()", "'' is no number"),
        ("normal(1, 0)", "normal(mean, sd) needs sd > 0"),
        ("uniform(2, 1)", "uniform(low, high) needs low < high"),
        ("loguniform(0, 1)", "loguniform(low, high) needs 0 < low < high"),
        ("triangular(0, 3, 2)", "triangular(low, mode, high) needs low <= mode <= high, and low < high"),
        ("truncnormal(0, -1, 0, 1)", "truncnormal(mean, sd, low, high) needs sd > 0 and low < high"),
        ("integers(0.5, 2)", "integers(low, high) needs whole numbers, low < high, up to 2**53"),
        ("normal(inf, 1)", "mean of normal(mean, sd) must be finite"),
        ("truncnormal(0, 1, nan, 2)", "low of truncnormal(mean, sd, low, high) is no number"),
    ],
)
def test_what_is_said_about_a_mistake(text, message):
    with pytest.raises(ScenarioError) as caught:
        Law.read(text)
    assert str(caught.value).startswith(message)
