"""What a description claims, and what the FMU does: dependencies, steps of other lengths, derivatives."""

import shutil

import pytest

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler")

ANY_STEP = 'canHandleVariableCommunicationStepSize="true"'
FEED_THROUGH = "if (vr[i] == 0) { v[i] = Y + M->u; continue; }"
STRICT = "if (M->phase == 2 && vr[i] == 0 && M->u != 0) abort();"


@pytest.mark.sample(4)
@pytest.mark.parametrize(
    ("depends", "code", "verdict", "part"),
    [
        ("2", {"on_get": FEED_THROUGH}, "pass", "1 outputs react to those of 1 inputs that they list"),
        ("", {"on_get": FEED_THROUGH}, "fail", "react to inputs that their dependencies leave out: y on u"),
        ("2", {}, "note", "dependencies that were never seen to act directly: y on u"),
        ("", {}, "pass", "1 outputs react"),
        (None, {"on_get": FEED_THROUGH}, "skipped", "no output says on what it depends"),
        ("", {"on_get": STRICT}, "pass", "1 outputs react"),
        ("2", {"on_get": STRICT}, "note", "y on u"),
        ("", {"on_get": "if (vr[i] == 0) { static double n; v[i] = n++; continue; }"}, "pass", "1 outputs react"),
    ],
)
def test_dependencies_are_tried(found, depends, code, verdict, part):
    told = found("dependencies", depends=depends, **code)
    assert told[0] == verdict
    assert part in told[1]


@pytest.mark.parametrize(
    ("code", "verdict", "part"),
    [
        ("", "pass", "steps of 0.05 s give what steps of 0.1 s give, but for 0.0"),
        ("if (h < 0.09) return fmi2Error;", "fail", "but not of 0.05 s: fmi2DoStep failed"),
        ("Y += 0.1; return fmi2OK;", "fail", "with steps of 0.05 s instead of 0.1 s outputs are others, by"),
    ],
)
def test_steps_of_other_lengths_are_tried_where_they_are_offered(found, code, verdict, part):
    told = found("steps", ANY_STEP, on_step=code)
    assert told[0] == verdict
    assert part in told[1]


def test_steps_of_other_lengths_are_not_tried_where_they_are_not_offered(found):
    assert found("steps", on_step="if (h < 0.09) return fmi2Error;")[0] == "skipped"


@pytest.mark.parametrize(
    ("claims", "verdict", "part"),
    [
        ("", "skipped", ""),
        ('canInterpolateInputs="true"', "fail", "fmi2SetRealInputDerivatives failed"),
        ('maxOutputDerivativeOrder="1"', "fail", "fmi2GetRealOutputDerivatives failed"),
    ],
)
def test_derivatives_are_tried_where_they_are_offered(found, claims, verdict, part):
    told = found("derivatives", claims)
    assert told[0] == verdict
    assert part in told[1]


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    ("code", "verdict", "part"),
    [
        ("", "pass", "a run from a restored state repeats itself and the first"),
        ("M->y *= 1 + 1e-6;", "pass", "it is not the first to the last bit"),
        ("static int n; M->y *= 1 + 1e-6 * n++;", "fail", "other outputs after fmi2SetFMUstate"),
        ("M->y = 0;", "fail", "other outputs after fmi2SetFMUstate"),
    ],
)
def test_a_restored_run_is_compared_with_a_restored_run(found, code, verdict, part):
    """Dymola's FMUs, and others with a solver of many steps, begin anew where a state is restored."""
    told = found("state", on_restore=code)
    assert told[0] == verdict
    assert part in told[1]


@pytest.mark.sample(3)
@pytest.mark.parametrize(
    ("start", "value", "verdict"),
    [
        ("1", "1.0000000000000002", "pass"),
        ("1", "1.0001", "fail"),
        ("0.333333", "1.0/3.0", "pass"),
        ("0.333333", "0.33334", "fail"),
        ("1.4", "1.0", "fail"),
        ("1000000", "1000000.4", "fail"),
        ("1e-300", "0.0", "fail"),
    ],
)
def test_start_values_are_compared_as_they_are_printed(found, start, value, verdict):
    told = found("starts", start=start, on_get=f"if (vr[i] == 2) {{ v[i] = {value}; continue; }}")
    assert told[0] == verdict
