"""Units as text against the exponents of their definition (SI brochure, 9th ed.)."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from railcosim.components import CATALOGUE
from railcosim.fmus.units import BASE, parse


def meaning(text):
    found = parse(text)
    return {base: e for base, e in zip(BASE, found.exponents, strict=True) if e}, found.factor, found.offset


@pytest.mark.parametrize(
    ("text", "exponents", "factor", "offset"),
    [
        ("1", {}, 1.0, 0.0),
        ("m/s2", {"m": 1, "s": -2}, 1.0, 0.0),
        ("1/s", {"s": -1}, 1.0, 0.0),
        ("N", {"kg": 1, "m": 1, "s": -2}, 1.0, 0.0),
        ("N/kg", {"m": 1, "s": -2}, 1.0, 0.0),
        ("N.s/(m.kg)", {"s": -1}, 1.0, 0.0),
        ("N.s2/(m2.kg)", {"m": -1}, 1.0, 0.0),
        ("m4/s2", {"m": 4, "s": -2}, 1.0, 0.0),
        ("kg.m2.s-3", {"kg": 1, "m": 2, "s": -3}, 1.0, 0.0),
        ("m/s/s", {"m": 1, "s": -2}, 1.0, 0.0),
        ("kN/km", {"kg": 1, "s": -2}, 1.0, 0.0),
        ("km/h", {"m": 1, "s": -1}, 1000.0 / 3600.0, 0.0),
        ("mm2", {"m": 2}, 1e-6, 0.0),
        ("rad/s", {"rad": 1, "s": -1}, 1.0, 0.0),
        ("degC", {"K": 1}, 1.0, 273.15),
        ("%", {}, 0.01, 0.0),
    ],
)
def test_meaning(text, exponents, factor, offset):
    assert meaning(text) == (exponents, pytest.approx(factor, rel=1e-15), offset)


@given(
    st.lists(st.tuples(st.sampled_from(["kg", "m", "s", "A", "N", "W"]), st.integers(-4, 4)), min_size=1, max_size=5)
)
def test_a_product_adds_exponents_and_its_reciprocal_negates_them(factors):
    product = parse(".".join(f"{symbol}{power}" for symbol, power in factors))
    expected = [sum(power * parse(symbol).exponents[k] for symbol, power in factors) for k in range(len(BASE))]
    assert list(product.exponents) == expected
    inverse = parse(f"1/({'.'.join(f'{symbol}{power}' for symbol, power in factors)})")
    assert list(inverse.exponents) == [-e for e in expected]


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "ends too early"),
        ("m/", "ends too early"),
        ("(m.s", "lacks a closing parenthesis"),
        ("m)", "')' is out of place"),
        ("m^2", "is out of place"),
        ("m 2", "is out of place"),
        ("m s", "is out of place"),
        ("furlong/s", "'furlong' is not a unit known here"),
        ("10", "'10' is not a unit"),
    ],
)
def test_nonsense_is_refused(text, complaint):
    with pytest.raises(ValueError, match="unit") as caught:
        parse(text)
    assert complaint in str(caught.value)
    assert repr(text) in str(caught.value)


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_unit_of_the_catalogue_is_known(name):
    for slot in CATALOGUE[name]().slots.values():
        parse(slot.unit)
