"""Implicit coupling: which instances are repeated, how guesses are improved, what is said where that leads nowhere."""

import json
import re
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from railcosim.orchestrator import load
from railcosim.orchestrator.errors import CouplingError, FmuError
from railcosim.orchestrator.fmi.binding.loaded import LoadedSlave
from railcosim.orchestrator.fmi.plain import PlainSlave
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.master.algorithms import iterative
from railcosim.orchestrator.master.algorithms.acceleration import ACCELERATIONS
from railcosim.orchestrator.master.algorithms.iterative import find_blocks
from railcosim.orchestrator.master.coupling import Coupling
from railcosim.orchestrator.master.settings import DEFAULT
from railcosim.orchestrator.names import SignalName
from railcosim.orchestrator.run.checking import check
from railcosim.orchestrator.run.execution import execute, run
from railcosim.orchestrator.system import Connection, Judged, System
from railcosim.orchestrator.wiring import Link

# -------------------------------------------------------------------- from what was tried to what is tried next


def iterate(name, step, start, count, relaxation=1.0):
    """The guesses of a method on x = step(x)."""
    following, guess = ACCELERATIONS[name](relaxation), np.array(start, dtype=float)
    guesses = [guess]
    for _ in range(count):
        guess = following(guess, step(guess))
        guesses.append(guess)
    return guesses


def linear(n, seed, size):
    """x = A x + b of n unknowns with eigenvalues of the given size, and its solution."""
    random = np.random.default_rng(seed)
    q = np.linalg.qr(random.normal(size=(n, n)))[0]
    a = q @ np.diag(size * random.uniform(0.5, 1.0, n) * random.choice([-1.0, 1.0], n)) @ q.T
    b = random.normal(size=n)
    return lambda x: a @ x + b, np.linalg.solve(np.eye(n) - a, b)


@settings(max_examples=60, deadline=None)
@given(n=st.integers(1, 5), seed=st.integers(0, 10**6), size=st.sampled_from([0.5, 3.0]))
def test_anderson_solves_a_linear_problem_of_n_unknowns_in_n_plus_1_iterations(n, seed, size):
    """It is then GMRES in disguise (Walker and Ni 2011, theorem 2.2), and need not contract."""
    step, solution = linear(n, seed, size)
    guesses = iterate("anderson", step, np.zeros(n), n + 1)
    scale = max(1.0, np.abs(solution).max())
    assert np.abs(guesses[-1] - solution).max() < 1e-6 * scale
    assert n == 1 or np.abs(guesses[1] - solution).max() > 1e-6 * scale


def test_anderson_forgets_all_but_the_last_guesses():
    """Of 12 unknowns it does not find all at once, but goes on getting nearer."""
    step, solution = linear(12, 1, 0.9)
    errors = [np.abs(guess - solution).max() for guess in iterate("anderson", step, np.zeros(12), 60)]
    assert errors[13] > 1e-9
    assert errors[-1] < 1e-6
    plain = [np.abs(guess - solution).max() for guess in iterate("none", step, np.zeros(12), 60)]
    assert errors[-1] < 1e-2 * plain[-1]


@pytest.mark.parametrize("slope", [-5.0, -0.5, 0.5, 3.0])
def test_aitken_solves_a_linear_problem_of_one_unknown_in_two_iterations(slope):
    """The second is a secant step."""
    guesses = iterate("aitken", lambda x: slope * x + 1.0, [0.0], 2)
    assert guesses[-1][0] == pytest.approx(1.0 / (1.0 - slope), rel=1e-12)


@pytest.mark.parametrize(("relaxation", "factor"), [(1.0, -2.0), (0.5, -0.5), (0.25, 0.25), (1.0 / 3.0, 0.0)])
def test_relaxation_changes_the_factor_of_plain_iteration(relaxation, factor):
    """From q to 1 - w (1 - q)."""
    errors = [g[0] - 1.0 / 3.0 for g in iterate("none", lambda x: 1.0 - 2.0 * x, [0.0], 3, relaxation)]
    assert errors[2] == pytest.approx(factor * errors[1], abs=1e-12)


@pytest.mark.parametrize("name", ["none", "aitken", "anderson"])
def test_a_guess_that_is_right_stays(name):
    guesses = iterate(name, lambda x: x, [1.0, 2.0], 3)
    assert all(np.array_equal(guess, [1.0, 2.0]) for guess in guesses)


def test_anderson_of_infinite_residuals_gives_no_guess():
    with np.errstate(over="ignore"):
        guesses = iterate("anderson", lambda x: x * 1e200, [1.0], 3)
    assert not np.isfinite(guesses[-1]).all()


# -------------------------------------------------------------------- what is repeated


def facts(sampled=()):
    """Interfaces by name, of which blocks need to know one thing only."""
    return lambda names: {n: SimpleNamespace(sampled=n in sampled) for n in names}


def link(source, target, delay=0):
    a, b = SignalName(source, "y"), SignalName(target, "u")
    return Link(a, b, 1.0, 0.0, delay, False, Connection(str(a), str(b), delay))


def blocks(names, *links, sampled=()):
    return find_blocks(facts(sampled)(names), [link(*pair) for pair in links])


def test_what_forms_no_cycle_steps_once_sources_first():
    found = blocks("abcd", ("d", "c"), ("c", "a"))
    assert found.continuous == (("b",), ("d",), ("c",), ("a",))
    assert found.cyclic == frozenset()
    assert found.sampled == ()


def test_a_cycle_is_one_group_between_what_comes_before_and_after():
    found = blocks("abcde", ("e", "c"), ("c", "a"), ("a", "c"), ("a", "b"), ("d", "d"))
    assert found.continuous == (("d",), ("e",), ("a", "c"), ("b",))
    assert found.cyclic == {"a", "c", "d"}


def test_a_delay_breaks_a_cycle():
    assert blocks("ab", ("a", "b"), ("b", "a", 1)).cyclic == frozenset()


def test_sampled_components_step_first_and_break_cycles():
    found = blocks("pqrs", ("p", "q"), ("q", "p"), ("r", "s"), ("s", "r"), sampled="qs")
    assert found.sampled == ("q", "s")
    assert found.continuous == (("p",), ("r",))
    assert found.cyclic == frozenset()


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), max_size=15), st.sets(st.integers(0, 6), max_size=3))
def test_blocks_are_a_partition_in_an_order_that_serves_every_connection(pairs, sampled):
    names = [str(k) for k in range(7)]
    found = blocks(names, *((str(a), str(b)) for a, b in pairs), sampled={str(k) for k in sampled})
    flat = [name for group in found.continuous for name in group]
    assert sorted([*flat, *found.sampled]) == names
    at = {name: k for k, group in enumerate(found.continuous) for name in group}
    for a, b in pairs:
        if {a, b}.isdisjoint(sampled):
            assert at[str(a)] <= at[str(b)]
            if a == b or at[str(a)] == at[str(b)]:
                assert {str(a), str(b)} <= found.cyclic


def test_only_what_forms_a_cycle_is_repeated(mine):
    """Steps of each, and saved states: the source steps once, the two that depend on each other four times."""
    calls = []
    it = System(stop_time=0.3, step=0.1, algorithm="iterative")
    it.add("source", mine("Lag"))
    it.add("a", mine("Lag"), gain=-0.5)
    it.add("b", mine("Lag"))
    it.add("last", mine("Lag"))
    for source, target in (("source.x", "last.u"), ("a.x", "b.u"), ("b.x", "a.u")):
        it.connect(source, target)
    with pytest.MonkeyPatch.context() as patch:
        for name in ("step", "save", "forget", "restore"):
            call = getattr(PlainSlave, name)
            patch.setattr(
                PlainSlave, name, lambda s, *a, _n=name, _c=call, **k: (calls.append((s.name, _n)), _c(s, *a, **k))[1]
            )
        outcome = run(it, kind="plain")
    for name in ("source", "last"):
        assert [call for who, call in calls if who == name] == ["step"] * 3
    total = round(3 * outcome.coupling["iterative"]["iterations_per_step"])
    for name in ("a", "b"):
        mine = [call for who, call in calls if who == name]
        assert (mine.count("step"), mine.count("restore")) == (total, total - 3)
        assert mine.count("save") == mine.count("forget") == 3


def test_only_what_is_needed_too_early_is_guessed(mine):
    """In a ring each value but the last is passed on fresh: one unknown, which two secant steps find."""
    it = System(stop_time=0.2, step=0.1, algorithm="iterative", acceleration="aitken")
    for k in range(6):
        it.add(f"lag[{k}]", mine("Lag"), gain=-4.0)
        it.connect(f"lag[{k}].x", f"lag[{(k + 1) % 6}].u")
    assert run(it, kind="plain").coupling["iterative"]["most_iterations"] <= 4


def test_a_loop_of_three_unknowns_is_solved_in_five_iterations(mine):
    """y = A y + b without contraction: n + 1 to find it, one to see that it is right."""
    rows = {"p": (0.5, -2.0, 1.0), "q": (1.5, 0.3, -1.0), "r": (-0.7, 1.2, 0.4)}
    it = System(stop_time=0.2, step=0.1, algorithm="iterative", tolerance=1e-9)
    for name, row in rows.items():
        it.add(name, mine("Mix"), **dict(zip("abc", row, strict=True)))
        for source, into in zip(rows, "uvw", strict=True):
            it.connect(f"{source}.y", f"{name}.{into}")
    outcome = run(it, kind="plain")
    expected = np.linalg.solve(np.eye(3) - np.array(list(rows.values())), np.ones(3))
    for name, value in zip(rows, expected, strict=True):
        assert outcome[f"{name}.y"] == pytest.approx(value * (1.0 + outcome.time), rel=1e-7)
    assert outcome.coupling["iterative"]["most_iterations"] <= 5


# -------------------------------------------------------------------- sampled components


def test_sampled_components_act_on_values_of_the_begin(mine):
    """As with gauss-seidel, and although the plant is stepped with the values of the step's end otherwise."""

    def made(algorithm):
        it = System(stop_time=1.0, step=0.1, algorithm=algorithm)
        it.add("plant", mine("Lag"))
        it.add("control", mine("Sampler"))
        it.connect("plant.x", "control.u")
        it.connect("control.y", "plant.u")
        return run(it, kind="plain")

    one, two = made("gauss-seidel"), made("iterative")
    for name in one.names():
        assert one[name] == pytest.approx(two[name], rel=1e-14), name
    assert two["control.seen"][1:] == pytest.approx(two["plant.x"][:-1], rel=1e-14)


def test_a_platoon_of_sampled_controllers_is_that_of_gauss_seidel():
    """To the bit: nothing is late there, and no continuous components act on each other."""
    runs = []
    for algorithm in ("gauss-seidel", "iterative"):
        it = load("fault_tolerant_cruise", preset="nominal")
        it.stepping.algorithm, it.stepping.stop_time = algorithm, 0.4
        it.judged = Judged()
        runs.append(run(it, kind="plain"))
    a, b = runs
    assert a.checked.order.late == ()
    assert len(a.names()) > 50
    assert np.ptp(a["train[1].tail_speed"]) > 0.01
    for name in a.names():
        assert np.array_equal(a[name], b[name]), name
    assert b.coupling["iterative"]["most_iterations"] == 0


# -------------------------------------------------------------------- where it leads nowhere


def test_truth_values_are_repeated_too(mine):
    """A relay that switches within the step: on at its begin, off at its end, and off is what acts."""
    it = System(stop_time=1.0, step=0.3, algorithm="iterative", record=0.3)
    it.stepping.stop_time = 0.9
    it.add("heater", mine("Heater"), x=0.0)
    it.add("relay", mine("Level"), upside_down=True, level=-1.0)
    it.connect("heater.x", "relay.u")
    it.connect("relay.on", "heater.on")
    outcome = run(it, kind="plain")
    assert list(outcome["relay.on"]) == [0, 0, 0, 0]
    assert outcome["heater.x"] == pytest.approx([0.0, -0.3, -0.6, -0.9])


def test_truth_values_that_flip_for_ever_are_said_to(mine):
    """On, it ends too high for being on; off, too low for being off."""
    it = System(stop_time=0.9, step=0.3, algorithm="iterative", max_iterations=7)
    it.add("heater", mine("Heater"), x=0.0)
    it.add("relay", mine("Level"), upside_down=True, level=0.1)
    it.connect("heater.x", "relay.u")
    it.connect("relay.on", "heater.on")
    with pytest.raises(CouplingError) as caught:
        run(it, kind="plain")
    text = str(caught.value)
    assert text.startswith("t = 0 s: the coupling through ")
    assert "relay.on" in text
    assert "does not converge: after 7 iterations of the step of 0.3 s" in text


def test_an_fmu_that_fails_of_a_guess_is_not_blamed_alone(mine):
    """The guesses drive the root's argument below nought: that is the iteration's doing. It starts at the solution."""
    it = System(stop_time=0.5, step=0.5, algorithm="iterative", acceleration="none")
    solution = (5.0**0.5 - 2.0) ** 2
    it.add("a", mine("Root"), gain=4.0, u=solution)
    it.add("b", mine("Mix"), a=1.0, bias=0.0, u=solution)
    it.connect("a.y", "b.u")
    it.connect("b.y", "a.u")
    with pytest.raises(CouplingError) as caught:
        run(it, kind="plain")
    text = str(caught.value)
    assert "the coupling through a.y" in text
    assert "diverges" in text
    assert "with the next guess an FMU fails (a, " in text
    assert isinstance(caught.value.__cause__, FmuError)


def rough(fmu, **how):
    """x'' = -x - x'/2 in two FMUs, one of which solves its own part to 1e-5 only."""
    it = System(**{"stop_time": 1.0, "step": 0.1, "algorithm": "iterative"} | how)
    it.add("p", fmu, a=-0.5, c=-1.0, start=0.0)
    it.add("q", fmu, c=1.0, start=1.0)
    it.connect("p.y", "q.u")
    it.connect("q.y", "p.u")
    return it


def test_values_cannot_agree_better_than_their_fmus_solve(species):
    """The tolerance that would do is said, and it does."""
    with pytest.raises(CouplingError) as caught:
        run(rough(species([], "-DROUGH")))
    advised = re.search(r"take a smaller step, simulation\.tolerance = (\S+), more", str(caught.value))
    assert 1e-6 < float(advised[1]) < 1e-3
    result = run(rough(species([], "-DROUGH"), tolerance=float(advised[1])))
    assert result["q.y"][-1] == pytest.approx(0.5999, abs=0.1)


def test_the_tolerance_is_no_smaller_than_that_of_the_fmus(species, workspace):
    """Unless one is given: by the DefaultExperiment."""
    it = rough(species([], "-DROUGH", tolerance=1e-4))
    told = "p, q agree to a tolerance of 0.0001, at most: that of their own solvers (DefaultExperiment)"
    assert told in check(it, workspace).notes
    result = run(it)
    assert result.status == "completed"
    assert result.coupling["iterative"]["unsettled"] == 0
    it.stepping.tolerance = 1e-8
    assert told not in check(it, workspace).notes
    with pytest.raises(CouplingError):
        run(it)


def test_it_goes_on_where_it_is_told_to(mine, tmp_path):
    """On, it ends too high for being on; off, too low for being off: the last iterate stands, and is counted."""
    it = System(stop_time=0.9, step=0.3, algorithm="iterative", max_iterations=7, unsettled="go-on")
    it.add("heater", mine("Heater"), x=0.0)
    it.add("relay", mine("Level"), upside_down=True, level=0.1)
    it.connect("heater.x", "relay.u")
    it.connect("relay.on", "heater.on")
    result = run(it, kind="plain", output=tmp_path)
    assert result.status == "completed"
    assert np.abs(np.diff(result["heater.x"])) == pytest.approx([0.3] * 3)
    told = json.loads((tmp_path / "run.json").read_text())
    assert told["unsettled"] == "go-on"
    told = told["coupling"]["iterative"]
    assert told["unsettled"] == len(told["first_unsettled"]) > 0
    assert told["first_unsettled"][0] == 0.0
    assert f"; {told['unsettled']} of 3 steps went on unsettled, the first from t = 0 s" in told["summary"]


@pytest.mark.parametrize("attempts", [9, 200])  # nobody waits for all of the second
def test_it_does_not_go_on_where_values_get_away(mine, attempts):
    it = System(stop_time=2.0, step=1.0, algorithm="iterative", acceleration="none", max_iterations=attempts)
    it.stepping.unsettled = "go-on"
    it.add("a", mine("Lag"), gain=-5.0)
    it.add("b", mine("Lag"), gain=5.0)
    it.connect("a.x", "b.u")
    it.connect("b.x", "a.u")
    with pytest.raises(CouplingError) as caught:
        run(it, kind="plain")
    assert re.search(r"diverges: after (9|1\d) iterations", str(caught.value))


@pytest.mark.parametrize("fails", [False, True])
@pytest.mark.parametrize("loop", ["compiled", "python"])
def test_saved_states_are_given_back(mine, monkeypatch, fails, loop):
    """Of native FMUs, whose states are memory: also where the iterations lead nowhere."""
    kept = [*"ab"] if fails and loop == "compiled" else []  # those that the compiled loop has saved, but not given back
    if loop == "python":
        monkeypatch.setattr(compiled, "kernel", None)
    save, forget = LoadedSlave.save, LoadedSlave.forget
    monkeypatch.setattr(LoadedSlave, "save", lambda s: kept.append(s.name) or save(s))
    monkeypatch.setattr(LoadedSlave, "forget", lambda s, state: kept.remove(s.name) or forget(s, state))
    how = {"acceleration": "none", "max_iterations": 4} if fails else {}
    it = System(stop_time=2.0, step=1.0, algorithm="iterative", **how)
    it.add("a", mine("Lag"), gain=-5.0)
    it.add("b", mine("Lag"))
    it.connect("a.x", "b.u")
    it.connect("b.x", "a.u")
    outcome = execute(it, kind="native")
    assert outcome.status == ("failed" if fails else "completed")
    assert outcome.coupling["iterative"]["most_iterations"] > 0 or fails
    assert kept == []


def test_what_is_told_of_the_iterations():
    it = iterative.Iterative(Coupling({}, [], [], DEFAULT, is_sweeping=True, is_of_end=True))
    assert it.report()["iterations_per_step"] == 0.0
    it._steps = 4
    it._iterations = {("a", "b"): SimpleNamespace(counted=lambda: (10, 5, 0.5), unsettled=[])}
    assert it.report() == {
        "iterations_per_step": 2.5,
        "most_iterations": 5,
        "worst_residual_per_tolerance": 0.5,
        "unsettled": 0,
        "first_unsettled": [],
        "summary": "2.5 iterations per step, at most 5; worst residual 0.5 of the tolerance",
    }
