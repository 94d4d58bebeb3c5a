"""Declarations become an interface, values are checked, and every mistake is answered by name and remedy."""

import numpy as np
import pytest
from railcosim.components import (
    CATALOGUE,
    ComfortCruise,
    Component,
    ComponentError,
    Data,
    Input,
    Memory,
    Noise,
    Output,
    Parameter,
    PointMassTrain,
    Schedule,
    Size,
    State,
    Tape,
)


def test_a_formula_reads_in_one_line(samples):
    """By hand: 2 teeth per tooth times 3 teeth."""
    assert samples.Types(teeth=3).outputs()["turned"] == 6


def test_sizes_shape_arrays_and_name_their_elements(samples):
    chain = samples.Chain(masses=4)
    assert chain.slots["position"].shape == (4,)
    assert chain.slots["stiffness"].shape == (3,)
    assert chain.slots["force"].scalars == ("force[1]", "force[2]", "force[3]", "force[4]")
    assert chain.slots["mass"].scalars == ("mass",)
    assert chain.build_arguments == {"masses": 4}
    assert samples.Chain.declarations["masses"].default == 3


def test_two_axes_are_named_in_row_major_order():
    class Grid(Component):
        rows = Size(2)
        cell = Parameter("1", 0.0, shape=(rows, rows + 1))

    assert Grid().slots["cell"].scalars == (
        "cell[1,1]",
        "cell[1,2]",
        "cell[1,3]",
        "cell[2,1]",
        "cell[2,2]",
        "cell[2,3]",
    )


def test_a_scalar_fills_an_array_and_a_list_sets_it(samples):
    assert samples.Chain(force=2).force.tolist() == [2.0, 2.0, 2.0]
    assert samples.Chain(force=[1, 2, 3]).force.tolist() == [1.0, 2.0, 3.0]
    assert samples.Chain().force.dtype == np.float64


def test_an_array_of_no_elements_is_allowed():
    class Alone(Component):
        cars = Size(1)
        coupler = State("m", shape=(cars - 1,), output=True)

        def initial(self):
            return {"coupler": self.coupler}

        def derivatives(self):
            return {"coupler": self.coupler}

    from railcosim.components import simulate

    assert simulate(Alone(), 0.2, 0.1)["coupler"].shape == (3, 0)


def test_types_follow_start_or_type():
    class Kinds(Component):
        whole = Parameter("1", 1, type=int)
        plain = Parameter("1", 1)
        switch = Parameter("1", True)
        switches = Parameter("1", [True, False], shape=(2,))
        text = Parameter("1", "a")

    built = Kinds()
    assert [built.slots[n].type for n in ("whole", "plain", "switch", "switches", "text")] == [
        int,
        float,
        bool,
        bool,
        str,
    ]
    assert type(built.plain) is float
    assert built.switches.dtype == bool


def test_runtime_parameters_belong_only_where_they_govern_something(samples):
    assert "max_step" in PointMassTrain.declarations
    assert "sample_time" not in PointMassTrain.declarations
    assert {"sample_time", "tape_file", "tape_duration", "tape_cutoff"} <= set(samples.Learner.declarations)
    assert {"sample_time", "seed"} <= set(samples.Dice.declarations)
    assert "seed" not in samples.Learner.declarations
    assert not {"sample_time", "max_step", "seed"} & set(Schedule.declarations)
    assert samples.Counter.declarations["sample_time"].start == 0.1


def test_output_slots_are_outputs_and_shown_states_and_memory(samples):
    assert [s.name for s in samples.Counter().output_slots] == ["total", "last_time", "last_step", "through", "count"]


def test_data_is_converted_and_may_name_a_unit(samples):
    slope = samples.Slope(profile=[[0, 0], [10, 5]], height_unit="km")
    assert slope.profile == ((0.0, 10.0), (0.0, 5.0))
    assert slope.slots["height"].unit == "km"
    assert slope.build_arguments == {"profile": [[0, 0], [10, 5]], "height_unit": "km"}
    assert slope.__class__(position=5.0).outputs()["height"] == 0.05


def test_random_numbers_can_be_given_to_look_at_one_case(samples):
    """By hand: 1 + 0.5 * 3."""
    assert samples.Dice(u=1.0, deviation=0.5, normal=3).outputs()["noisy"] == 2.5


def test_optional_inputs_are_marked(samples):
    assert samples.Types.declarations["offset"].optional
    assert not samples.Types.declarations["teeth"].optional


def test_every_shipped_component_describes_itself():
    for component in CATALOGUE.values():
        built = component()
        assert component.__doc__
        for name, declaration in component.declarations.items():
            assert declaration.description, f"{component.__name__}.{name}"
        assert built.output_slots


# ---------------------------------------------------------------- messages


def message(call):
    with pytest.raises(ComponentError) as caught:
        call()
    return str(caught.value)


def test_an_unknown_name_suggests_the_nearest():
    assert message(lambda: ComfortCruise(sped=1.0)) == "ComfortCruise has no 'sped'; did you mean 'speed'?"


def test_an_unknown_name_without_a_near_one_lists_all(samples):
    text = message(lambda: samples.Slope(zzzzzz=1.0))
    assert text == "Slope has no 'zzzzzz'; it has height, height_unit, position, profile, time"


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({"force": [1.0, 2.0]}, "Chain.force has shape (3,), but the value given has (2,)"),
        ({"mass": np.ones(2)}, "Chain.mass is a scalar, but an array of shape (2,) was given"),
        ({"mass": [1.0]}, "Chain.mass takes a float, not [1.0]"),
        ({"mass": "heavy"}, "Chain.mass takes a float, not 'heavy'"),
        ({"mass": True}, "Chain.mass takes a float, not True"),
        ({"mass": None}, "Chain.mass takes a float, not None"),
        ({"mass": float("nan")}, "Chain.mass takes a finite number, not nan"),
        ({"force": [0.0, float("inf"), 0.0]}, "Chain.force takes a finite number, not inf"),
        ({"force": [0.0, True, 0.0]}, "Chain.force takes a float, not True"),
        ({"force": [[1.0], [2.0, 3.0]]}, "Chain.force has shape (3,), but the value given has (2,)"),
        ({"masses": 1}, "Chain: build argument 'masses' takes a whole number of at least 2, not 1"),
        ({"masses": 2.0}, "Chain: build argument 'masses' takes a whole number of at least 2, not 2.0"),
        ({"masses": True}, "Chain: build argument 'masses' takes a whole number of at least 2, not True"),
        (
            {"masses": 10**9},
            "Chain: build argument 'masses' is 1000000000; arrays have at most 10000 elements on an axis",
        ),
        ({"time": [1.0]}, "Chain.time takes a float, not [1.0]"),
        ({"momentum": 1.0}, "Chain.momentum is computed and cannot be set"),
    ],
)
def test_a_wrong_value_names_the_place(samples, values, expected):
    assert message(lambda: samples.Chain(**values)) == expected


def test_a_value_may_be_called_as_python_calls_the_object(samples):
    assert message(lambda: samples.Chain(self=1)).startswith("Chain has no 'self'; it has force, mass")


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({"teeth": 1.5}, "Types.teeth takes a int, not 1.5"),
        ({"teeth": True}, "Types.teeth takes a int, not True"),
        ({"doors": [0, 1]}, "Types.doors takes a bool, not 0"),
        ({"label": 3}, "Types.label takes a str, not 3"),
    ],
)
def test_integers_booleans_and_texts_are_not_mixed_up(samples, values, expected):
    assert message(lambda: samples.Types(**values)) == expected


@pytest.mark.parametrize("raw", [[[0.0, 0.0], [0.0, 1.0]], [[0.0]], 7, [["a", "b"]], None])
def test_unusable_data_says_which_argument_and_why(samples, raw):
    text = message(lambda: samples.Slope(profile=raw))
    assert text.startswith("Slope: build argument 'profile' is unusable: ")
    assert len(text) > len("Slope: build argument 'profile' is unusable: ")
    if raw == [[0.0, 0.0], [0.0, 1.0]]:
        assert text.endswith("positions must rise")


def test_a_size_too_small_for_an_array_says_so():
    class Pairs(Component):
        cars = Size(3)
        couplers = Parameter("1", shape=(cars - 2,))

    assert message(lambda: Pairs(cars=1)) == "Pairs: cars = 1 leaves an array of length -1; take at least 2"


@pytest.mark.parametrize("flag", [Input("1", 0.0), Input("1", False, shape=(2,)), Input("1", False)])
def test_a_flag_is_a_boolean_input_of_the_same_component(flag):
    """The last one is such an input, but of no component."""
    names = {"flag": flag} if flag.shape or flag.type is float else {}
    with pytest.raises(ComponentError, match=r"Case\.u: its flag must be a boolean Input of the same component"):
        type("Case", (Component,), names | {"u": Input("m", flag=flag)})


def test_equations_cannot_assign(samples):
    text = message(lambda: setattr(samples.Counter(), "total", 1.0))
    assert text.startswith("Counter.total cannot be assigned: the methods are pure")


def test_arrays_cannot_be_changed_in_place(samples):
    with pytest.raises(ValueError, match="read-only"):
        samples.Chain().force[0] = 1.0


def test_an_output_cannot_be_read_by_the_equations(samples):
    with pytest.raises(AttributeError, match=r"Chain\.momentum has no value to read: an output is what outputs"):
        _ = samples.Chain().momentum


def test_the_step_is_known_in_update_only(samples):
    assert message(lambda: samples.Counter().step) == "Counter: self.step is known only inside update()"


# ---------------------------------------------------------------- wrong classes


def test_a_plain_value_cannot_hide_a_declaration():
    """An author who means to change a default would otherwise keep the old one."""

    def declare():
        class Mine(ComfortCruise):
            alpha = 0.01

    assert message(declare).startswith(
        "Mine.alpha hides the declaration of that name; declare it anew, alpha = Parameter"
    )


def test_a_redeclared_parameter_takes_the_new_default():
    class Mine(ComfortCruise):
        alpha = Parameter("1/s", 0.01)

    assert Mine().alpha == 0.01
    assert ComfortCruise().alpha != 0.01


@pytest.mark.parametrize("name", ["outputs", "time", "step", "slots", "source", "build_arguments", "present_values"])
def test_names_of_the_base_class_are_taken(name):
    text = message(lambda: type("Bad", (Component,), {name: Parameter("1", 0.0)}))
    assert text.endswith(f".{name}: the name belongs to Component; choose another")


@pytest.mark.parametrize(
    "inputs",
    [
        {},
        {"trip": Input("1", 1, type=int)},
        {"trip": Input("1", 1.0), "trip_time": Input("s")},
        {"trip": Parameter("1", 1, type=int), "trip_time": Input("s")},
        {"trip": Input("1", 1, type=int), "trip_time": Input("s", shape=(2,))},
    ],
)
def test_a_tape_needs_its_two_inputs(inputs):
    named = {}
    for name, declaration in inputs.items():
        declaration.__set_name__(Component, name)
        named[name] = declaration
    text = message(lambda: type("Bad", (Component,), {"learned": Tape("1"), **named}))
    assert text == "Bad.learned is a tape, but the inputs 'trip' (type = int) and 'trip_time' (real) are not declared"


def test_a_state_is_a_real_number():
    assert (
        message(lambda: type("Bad", (Component,), {"n": State("1", 0, type=int)})) == "Bad.n: a State is a real number"
    )


def test_noise_is_held_by_a_parameter_of_the_same_component():
    stranger = Parameter("s", 0.1)
    stranger.__set_name__(Component, "elsewhere")
    text = message(lambda: type("Bad", (Component,), {"n": Noise(stranger)}))
    assert text == "Bad.n: hold must be a Parameter of the same component"


def test_the_error_is_the_builtin_a_caller_would_catch():
    assert issubclass(ComponentError, ValueError)


def test_declarations_read_as_themselves_on_the_class(samples):
    assert isinstance(samples.Counter.total, Memory)
    assert isinstance(samples.Slope.profile, Data)
    assert isinstance(samples.Slope.height, Output)
    assert repr(samples.Counter.total) == "<Memory total>"


def test_present_values_are_what_the_equations_read():
    schedule = Schedule(points=2, times=(0.0, 1.0), values=(1.0, 3.0))
    place = schedule.present_values
    assert schedule.present_values is place
    assert set(place) == {"unit", "points", "times", "values", "interpolate"}
    place["values"] = np.array([5.0, 7.0])
    place["time"] = 2.0
    assert schedule.outputs() == {"value": 7.0}
