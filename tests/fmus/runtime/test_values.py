"""values.c: what may be got and set, whose starts follow, and models of many values or of none."""

import math
from ctypes import byref, c_char_p, c_double, c_int, c_size_t, c_uint
from pathlib import Path

import pytest
from railcosim.components import PointMassTrain
from railcosim.components.declarations import Parameter

SAMPLES = Path(__file__).parents[1] / "native_samples.py"
MIXED = f"{SAMPLES}:Mixed"
OTHERS = Path(__file__).parents[2] / "components" / "samples.py"
CHAIN = f"{OTHERS}:Chain"
OK = 0
ERROR = 3
STEP = 0.25
NULL = None
REALS = c_double


# ---------------------------------------------------------------- the calling sequence


def one(cell, value=0):
    return (cell * 1)(value)


def reference(fmu, name):
    return one(c_uint, fmu.references[name]), c_size_t(1)


# ---------------------------------------------------------------- values


def test_value_references_out_of_range_and_of_another_type_are_refused(load):
    fmu = load(MIXED).initialize()
    count = len(fmu.references)
    for name, kind in fmu.types.items():
        for other in ("Real", "Integer", "Boolean", "String"):
            cell = (c_char_p if other == "String" else c_double if other == "Real" else c_int) * 1
            status = getattr(fmu, f"Get{other}")(*reference(fmu, name), cell())
            assert (status == OK) == (other == kind), (name, other)
            if other != kind:
                assert name in fmu.said or "reference" in fmu.said
                assert (
                    getattr(fmu, f"Set{other}")(*reference(fmu, name), cell(b"1" if other == "String" else 1)) == ERROR
                )
    for far in (count, count + 1, 2**31, 2**32 - 1):
        for other, cell in (("Real", c_double), ("Integer", c_int), ("Boolean", c_int), ("String", c_char_p)):
            assert getattr(fmu, f"Get{other}")(one(c_uint, far), c_size_t(1), (cell * 1)()) == ERROR
            assert str(far) in fmu.said
            assert getattr(fmu, f"Set{other}")(one(c_uint, far), c_size_t(1), (cell * 1)()) == ERROR
        assert (
            fmu.GetDirectionalDerivative(
                one(c_uint, far), c_size_t(1), *reference(fmu, "u[1]"), one(REALS, 1), one(REALS)
            )
            == ERROR
        )
        assert (
            fmu.GetDirectionalDerivative(*reference(fmu, "z"), one(c_uint, far), c_size_t(1), one(REALS, 1), one(REALS))
            == ERROR
        )


@pytest.mark.parametrize("kind", ["Real", "Integer", "Boolean", "String"])
def test_no_values_need_no_arrays_and_some_do(load, kind):
    fmu = load(MIXED).initialize()
    some = one(c_uint, 0)
    for way in ("Get", "Set"):
        call = getattr(fmu, f"{way}{kind}")
        assert call(NULL, c_size_t(0), NULL) == OK
        assert call(some, c_size_t(0), NULL) == OK
        assert call(NULL, c_size_t(1), (c_double * 1)()) == ERROR
        assert call(some, c_size_t(1), NULL) == ERROR
        assert "NULL" in fmu.said


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_numbers_that_are_not_finite_are_refused_and_nothing_is_taken(load, value):
    fmu = load("PointMassTrain").initialize()
    names = ("force", "disturbance")
    vr = (c_uint * 2)(*(fmu.references[n] for n in names))
    assert fmu.SetReal(vr, c_size_t(2), (c_double * 2)(5.0, value)) == ERROR
    assert "disturbance takes a finite number" in fmu.said
    assert [fmu.get(n) for n in names] == [0.0, 0.0]


def test_texts_come_back_and_have_a_limit(load):
    fmu = load(MIXED).enter()
    assert fmu.get("label") == b"a label"
    for text in ("", "Köln % # \\n", "x" * 1023):
        assert fmu.set("label", text) == OK
        assert fmu.get("label").decode() == text
    assert fmu.set("label", "x" * 1024) == ERROR
    assert "1023" in fmu.said
    assert fmu.SetString(*reference(fmu, "label"), one(c_char_p, NULL)) == ERROR
    assert fmu.get("label") == b"x" * 1023
    assert fmu.ExitInitializationMode() == OK
    assert fmu.set("label", "later") == ERROR
    assert fmu.set("remark", "an input") == OK


def test_parameters_keep_their_bounds(load):
    fmu = load(MIXED).initialize()
    assert fmu.set("gain", 2.5) == ERROR  # tunable: at once
    assert "gain = 2.5 is outside [0, 2]" in fmu.said
    assert fmu.get("gain") == 0.5
    assert fmu.set("gain", 2.0) == OK
    for name, value in (("gain", -0.1), ("teeth", 10), ("sample_time", -1.0)):
        fresh = load(MIXED).enter()
        assert fresh.set(name, value) == OK  # others may follow that it must be seen with
        assert fresh.ExitInitializationMode() == ERROR
        assert name in fresh.said
        assert fresh.step() == ERROR  # such an instance can only be reset


def test_computed_starts_follow_and_cannot_be_set(load):
    fmu = load(MIXED).enter()
    assert fmu.get("v") == 0.0625
    assert fmu.set("u[1]", 3.0) == OK
    assert fmu.get("v") == 9.0
    assert fmu.set("reverse", 1) == OK
    assert fmu.get("v") == -9.0
    assert fmu.set("v", 1.0) == ERROR
    assert "computed" in fmu.said
    assert fmu.set("x[1]", 7.0) == ERROR
    assert "computed" in fmu.said
    assert fmu.set("x_start[1]", 7.0) == OK
    assert fmu.get("x[1]") == 7.0
    assert fmu.ExitInitializationMode() == OK
    assert fmu.set("x_start[1]", 8.0) == ERROR
    assert "a fixed parameter; it can only be set before the run" in fmu.said
    assert (fmu.get("x_start[1]"), fmu.get("x[1]")) == (7.0, 7.0)


def test_outputs_are_fresh_after_a_set_and_held_over_a_step(load):
    """A feed-through output of a sampled block belongs to the inputs it was computed from."""
    fmu = load(MIXED).initialize(**{"x[1]": 0.0, "u[1]": 1.0})
    assert fmu.get("y[1]") == 1.5
    assert fmu.step() == OK
    assert fmu.get("y[1]") == 1.5
    assert fmu.get("x[1]") != 0.0
    assert fmu.set("u[1]", 2.0) == OK
    assert fmu.get("y[1]") == fmu.get("x[1]") + 2.0 + 0.5


# ---------------------------------------------------------------- size


@pytest.mark.long
def test_a_model_of_thousands_of_values_runs(load, write_component):
    many = write_component(
        "from railcosim.components import Component, Input, Output, Size, State\n"
        "class C(Component):\n"
        '    "Many of everything."\n'
        "    n = Size(1000)\n"
        '    u = Input("1", shape=(n,))\n'
        '    x = State("1", 1.0, shape=(n,))\n'
        '    y = Output("1", shape=(n,))\n'
        "    def derivatives(self):\n"
        '        return {"x": self.u - self.x}\n'
        "    def outputs(self):\n"
        '        return {"y": 2.0 * self.x}\n'
    )
    fmu = load(many).initialize()
    assert fmu.step() == OK
    assert fmu.get("y[1000]") == pytest.approx(2.0 * math.exp(-STEP), rel=1e-5)
    state = fmu.save()
    copy = fmu.from_bytes(fmu.to_bytes(state))
    assert fmu.SetFMUstate(copy) == OK
    assert fmu.directional(("y[1000]", "der(x[1])"), ("x[1000]", "u[1]"), (1.0, 3.0)) == [2.0, 3.0]
    for one_of in (state, copy):
        fmu.FreeFMUstate(byref(one_of))


def test_empty_arrays_are_no_variables(load, write_component):
    chain = load(CHAIN, {"masses": 2}).initialize()
    assert "tension[1]" in chain.references
    single = write_component(
        "from railcosim.components import Component, Output, Size, State\n"
        "class C(Component):\n"
        '    "One carriage has no coupler."\n'
        "    n = Size(1)\n"
        '    x = State("m", 1.0, shape=(n,), output=True)\n'
        '    pull = Output("N", shape=(n - 1,))\n'
        "    def derivatives(self):\n"
        '        return {"x": -self.x}\n'
        "    def outputs(self):\n"
        '        return {"pull": self.x[:-1] - self.x[1:]}\n'
    )
    fmu = load(single).initialize()
    assert fmu.step() == OK
    assert set(fmu.references) == {"max_step", "x_start[1]", "x[1]", "der(x[1])"}


def test_bounds_and_starts_are_those_of_the_component(load):
    train = PointMassTrain(speed=12.5, mass=3e5, limit_force=True)
    fmu = load(train).initialize()
    for slot in train.of(Parameter):
        assert fmu.get(slot.name) == train.present_values[slot.name]
    assert fmu.get("speed") == 12.5


def test_rates_are_read_with_others(load):
    """Several at once, among values."""
    fmu = load("PointMassTrain").initialize(speed=30.0)
    names = ("der(speed)", "speed", "der(position)", "acceleration")
    found = (c_double * len(names))()
    assert fmu.GetReal((c_uint * len(names))(*(fmu.references[n] for n in names)), c_size_t(len(names)), found) == OK
    assert list(found) == [fmu.get("acceleration"), 30.0, 30.0, fmu.get("acceleration")]
