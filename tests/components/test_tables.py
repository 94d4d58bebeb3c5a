"""Tables that components take: what is read, and what is refused with row, column and remedy."""

import pytest
from railcosim.components import ComponentError, Line, Protection, ReferenceProfile, Timetable
from railcosim.components.supervision.running_plan import PLAN
from railcosim.components.tables import Column, Table

CRATE = Table(
    "crate",
    [
        Column("place", "m", after="place"),
        Column("end", "m", default=1e9, after="place"),
        Column("count", type=int, sign="positive", default=1),
        Column("weight", "kg", sign="non-negative", default=0.0, note="loaded"),
        Column("fragile", type=bool, default=False),
        Column("speed", "m/s", default=None, word="any"),
    ],
)
PAIRS = Table("pair", [Column("begin", "s"), Column("end", "s")], whole=dict, by_place=True, may_be_empty=True)
SHELF = Table(
    "shelf", [Column("height", "m"), Column("crates", type=CRATE)], make=lambda height, crates: (height, crates)
)


def test_rows_have_their_values_in_the_order_of_the_columns():
    rows = CRATE.read(
        [{"place": 1}, {"speed": "any", "fragile": True, "count": 2, "weight": 3, "end": 5, "place": 2.5}]
    )
    assert rows == ((1.0, 1e9, 1, 0.0, False, None), (2.5, 5.0, 2, 3.0, True, "any"))
    assert [type(value) for value in rows[1]] == [float, float, int, float, bool, str]


def test_a_table_of_lists_and_what_is_made_of_it():
    assert PAIRS.read(((0, 1), [2.0, 3.0])) == {0.0: 1.0, 2.0: 3.0}
    assert PAIRS.read([]) == {}


def test_a_table_in_a_row():
    assert SHELF.record({"height": 2, "crates": [{"place": 0}]}) == (2.0, ((0.0, 1e9, 1, 0.0, False, None),))


def test_infinity_is_a_number():
    assert CRATE.read([{"place": 0.0, "end": float("inf")}])[0][1] == float("inf")


@pytest.mark.parametrize(
    ("row", "complaint"),
    [
        ({"place": 0.0}, "crate 2: 'place' must exceed 0.0: {'place': 0.0}"),
        ({"place": 3.0, "end": 3.0}, "crate 2: 'end' must exceed 'place', 3: {'place': 3.0, 'end': 3.0}"),
        ({}, "crate 2: 'place' must be a number in m, not None"),
        ({"place": None}, "crate 2: 'place' must be a number in m, not None"),
        ({"place": True}, "crate 2: 'place' must be a number in m, not True"),
        ({"place": float("nan")}, "crate 2: 'place' must be a number in m, not nan"),
        ({"place": "any"}, "crate 2: 'place' must be a number in m, not 'any'"),
        ({"place": 1.0, "speed": "some"}, "crate 2: 'speed' must be a number in m/s or 'any', not 'some'"),
        ({"place": 1.0, "speed": None}, "crate 2: 'speed' must be a number in m/s or 'any', not None"),
        ({"place": 1.0, "count": 0}, "crate 2: 'count' must be a positive whole number, not 0"),
        ({"place": 1.0, "count": 1.0}, "crate 2: 'count' must be a positive whole number, not 1.0"),
        ({"place": 1.0, "count": True}, "crate 2: 'count' must be a positive whole number, not True"),
        ({"place": 1.0, "weight": -1e-9}, "crate 2: 'weight' must be a non-negative number in kg, not -1e-09"),
        ({"place": 1.0, "fragile": 1}, "crate 2: 'fragile' must be true or false, not 1"),
        ({"place": 1.0, "wieght": 1.0}, "crate 2: a crate has no 'wieght'; did you mean 'weight'?"),
        (
            [1.0],
            "crate 2: a crate is a table of place (m), end (m), count, weight (kg, loaded), fragile, speed (m/s), not ",
        ),
    ],
)
def test_an_unusable_row(row, complaint):
    with pytest.raises(ValueError) as caught:  # noqa: PT011 (the message is the point)
        CRATE.read([{"place": 0.0}, row])
    assert str(caught.value).startswith(complaint)


@pytest.mark.parametrize(
    ("table", "data", "complaint"),
    [
        (CRATE, [], "crates are a list of at least one, each a table of place (m), "),
        (CRATE, "crate.json", "crates are a list of at least one, each a table of place (m), "),
        (CRATE, {"place": 1.0}, "crates are a list of at least one, each a table of place (m), "),
        (PAIRS, 3, "pairs are a list, each [begin (s), end (s)], not 3"),
        (PAIRS, [[1.0]], "pair 1: a pair is [begin (s), end (s)], not [1.0]"),
        (PAIRS, ["ab"], "pair 1: a pair is [begin (s), end (s)], not 'ab'"),
        (PAIRS, [{"begin": 1.0, "end": 2.0}], "pair 1: a pair is [begin (s), end (s)], not {"),
        (PAIRS, [[0.0, 1.0], [2.0, "x"]], "pair 2: 'end' must be a number in s, not 'x'"),
    ],
)
def test_an_unusable_table(table, data, complaint):
    with pytest.raises(ValueError) as caught:  # noqa: PT011 (the message is the point)
        table.read(data)
    assert str(caught.value).startswith(complaint)


def test_a_component_adds_its_name_and_the_key():
    with pytest.raises(ComponentError) as caught:
        Protection(limits=[[0.0, 20.0], [30.0, -1.0]])
    assert str(caught.value) == (
        "Protection: build argument 'limits' is unusable: speed limit 2: 'speed' must be a non-negative number in m/s, "
        "not -1.0"
    )


def test_of_a_table_in_a_table_the_inner_row_is_named():
    broken = PLAN | {"phases": [*PLAN["phases"][:3], PLAN["phases"][3] | {"acceleration": 0.0}]}
    with pytest.raises(ComponentError) as caught:
        Timetable(plan=broken)
    assert str(caught.value) == (
        "Timetable: build argument 'plan' is unusable: phase 4: 'acceleration' must be a positive number in m/s2, "
        "not 0.0"
    )


def test_a_number_beyond_all_bounds_is_refused_not_crashed_on():
    with pytest.raises(ComponentError, match="'limits' is unusable"):
        Protection(limits=[[0, 10**400]])


@pytest.mark.parametrize(
    ("build", "said"),
    [
        (lambda: Line(line=[{"position": 0.0, "gradient": 5.0}]), "section 1: 'gradient' is 5.0 (rise over run)"),
        (lambda: Line(line=[{"position": 0.0}, {"position": 9.0, "gradient": -20}]), "section 2: 'gradient' is -20"),
        (lambda: Line(line=[{"position": 0.0, "tunnel": -1.0}]), "'tunnel' is -1.0 (its length, in m)"),
        (
            lambda: Line(line=[{"position": 0.0, "resistance": 20.0}]),
            "'resistance' is 20.0 (further resistance to motion, in",
        ),
        (lambda: Line(line=[{"position": 0.0, "radius": 0.8}]), "'radius' is in m, 0 for straight track: 0.8"),
        (lambda: Protection(limits=[[0.0, 300.0]]), "speed limit 1: 'speed' is 300.0 (in m/s)"),
        (lambda: ReferenceProfile(profile={"speed": 250.0, "jerk": 0.1}), "'speed' is 250.0 (in m/s)"),
        (
            lambda: Timetable(plan={**PLAN, "phases": [{"begin": 0.0, "speed_km_h": 800.0, "acceleration": 0.9}]}),
            "800.0",
        ),
    ],
)
def test_what_no_train_can_have_is_refused_with_the_unit_that_is_meant(build, said):
    with pytest.raises(ComponentError) as told:
        build()
    assert said in str(told.value)


def test_what_trains_have_is_taken():
    """Lisbon's trams, a tram's curve, the Gotthard base tunnel; a record run."""
    Line(line=[{"position": 0.0, "gradient": 0.135, "radius": 11.0, "tunnel": 57.1e3}])
    Protection(limits=[[0.0, 574.8 / 3.6]])
