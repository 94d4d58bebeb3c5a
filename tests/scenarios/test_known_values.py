"""What holds of the known values of every shipped scenario, whatever they are; the values themselves: `reproduce`.

A tolerance is what rounding costs, and what was measured of sampling and noise; none is so wide that a broken model
would pass.
"""

import re
import tomllib
from collections import Counter
from decimal import Decimal
from pathlib import Path

import pytest
from railcosim.components import ComfortCruise
from railcosim.fmus.build import native_problem
from railcosim.orchestrator import load, run
from railcosim.orchestrator.evaluation import BAD
from railcosim.orchestrator.scenario import shipped
from railcosim.orchestrator.scenario.loading import find

ROOT = Path(__file__).parents[2]
MOST_SAMPLING, MOST_NOISE = 0.06, 0.13  # of the value
DIGITS_LOST = 0.001  # energies and forces are printed in kWh and kN: their last digit is not one of the value in SI
native = pytest.mark.skipif(bool(native_problem(ComfortCruise)), reason="needs native FMUs")


def written():
    """Every number of every shipped scenario with its digits: (scenario, entry)."""
    for name, _ in shipped():
        data = tomllib.loads(find(name).read_text(encoding="utf-8"), parse_float=Decimal)
        for section in ("published", "references"):
            for entry in data.get(section, []):
                if isinstance(entry.get("value"), int | Decimal) and not isinstance(entry["value"], bool):
                    yield name, entry


def half_of_the_last_digit(value):
    """What the rounding of a printed number may be; the zeros a whole number ends with may be digits or not."""
    digits = Decimal(value)
    last = int(digits.as_tuple().exponent)
    zeros = len(str(value)) - len(str(value).rstrip("0")) if isinstance(value, int) and value else 0
    return {5 * Decimal(10) ** (last + k - 1) for k in range(zeros + 1)}


def test_tolerances_are_rounding_and_what_was_measured():
    wrong = []
    for name, entry in written():
        tolerance, value = entry.get("tolerance"), entry["value"]
        if tolerance is None or not Decimal(value).is_finite():
            continue
        label = f"{name}: {entry['metric']} = {value} within {tolerance}"
        if not isinstance(tolerance, dict):
            wrong.append(f"{label}: its parts are not named")
            continue
        rounding, size = Decimal(tolerance.get("rounding", 0)), abs(Decimal(value))
        if rounding not in half_of_the_last_digit(value) and rounding > size * Decimal(DIGITS_LOST):
            wrong.append(f"{label}: the rounding is not half of the last digit")
        for part, most in (("sampling", MOST_SAMPLING), ("noise", MOST_NOISE)):
            if Decimal(tolerance.get(part, 0)) > size * Decimal(most) and "departs" not in entry:
                wrong.append(f"{label}: {part} is too wide")
    assert wrong == []


def test_every_origin_is_told_and_counted_apart():
    """The pages say how many there are: a value that moves from one origin to another is a claim that changes."""
    counts, departs = Counter(), Counter()
    for name, _ in shipped():
        judged = load(name).judged
        assert all(entry["where"] and entry["claim"] for entry in judged.published), name
        assert all("et al." not in entry["where"] and "Hou" not in entry["where"] for entry in judged.references), name
        for entry in [*judged.published, *judged.references]:
            origin = entry.get("origin", "reference")
            counts[origin] += 1
            departs[origin] += "departs" in entry
    readme, claims = ((ROOT / page).read_text(encoding="utf-8") for page in ("README.md", "docs/claims.md"))
    for origin, count in counts.items():
        assert f"| {origin} | {count} | {departs[origin] or ''}".rstrip() in claims
        assert re.search(rf"\b{count} (values are |more are )?\*{origin}s?\*", readme), origin


@pytest.mark.parametrize("name", [name for name, _ in shipped()])
def test_every_preset_says_what_it_is(name):
    origin = load(name).provenance
    assert origin.description
    assert [preset for preset, text in origin.preset_descriptions.items() if not text] == []


@native
@pytest.mark.parametrize(
    "setting", ["cruise.alpha=0.0275", "cruise.beta=0.0411", "cruise.gamma=3e8", "train.mass=4.4e5"]
)
def test_a_model_that_is_a_little_broken_is_noticed(setting):
    """20 % on a gain, 10 % on a mass that the controller does not know, three times the field."""
    scenario = "comfort_cruise_bottom_layer"
    result = run(load(scenario, settings=[setting]).changed(modified=False), figures=False)
    values = [*result.published, *result.references]
    assert len([row for row in values if row.verdict in BAD]) >= 3
