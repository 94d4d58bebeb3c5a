"""The linear model of a closed loop: matrices known by hand, ways to get them, and the command."""

import importlib.util
import json
import sys

import numpy as np
import pytest
from railcosim.orchestrator import System, load, run
from railcosim.orchestrator.cli.app import app
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.isolation import isolate
from railcosim.orchestrator.linearization.blocks import differences
from railcosim.orchestrator.linearization.closed_loop import linearize
from typer.testing import CliRunner

ALPHA, STEP = 0.2, 0.5
needs_native = pytest.mark.skipif(importlib.util.find_spec("casadi") is None, reason="casadi is not installed")
FREE = {"c0": 0.0, "c1": 0.0, "c2": 0.0}
PI = '''
class Pi(Base):
    """Proportional-integral control of the speed."""

    kp = Parameter("N.s/m", 0.3)
    ki = Parameter("N/m", 0.05)
    target = Input("m/s", 0.0)
    speed = Input("m/s", 0.0)
    force = Output("N")
    total = Memory("m", 0.0)

    def outputs(self):
        return {"force": self.kp * (self.target - self.speed) + self.ki * self.total}

    def update(self):
        return {"total": self.total + self.step * (self.target - self.speed)}
'''


def one_train(algorithm="gauss-seidel", delay=0):
    """A train without resistance under its cruise law: dv/dt = alpha (target - v)."""
    system = System(stop_time=10.0, step=STEP, algorithm=algorithm)
    system.add("train", "PointMassTrain", speed=5.0, **FREE)
    system.add("cruise", "ComfortCruise", alpha=ALPHA, comfort_layer=False, rejoin_time=4.0, **FREE)
    system.add("target", "Schedule", values=8.0)
    system.connect("train.position", "cruise.position")
    system.connect("train.speed", "cruise.speed")
    system.connect("target.value", "cruise.target_speed")
    system.connect("cruise.force", "train.force", delay=delay)
    return system


def pick(model, *names):
    """The block of A that belongs to these states."""
    at = [model.states.index(name) for name in names]
    return model.a[np.ix_(at, at)]


# ---------------------------------------------------------------- one train: everything is known


@needs_native
def test_one_train_has_the_matrices_of_its_equations():
    """dx/dt = v, dv/dt = alpha (target - v) + w: eigenvalues 0 and -alpha, and the fallback's -1/rejoin_time."""
    model = linearize(one_train(), 1.0)
    assert model.step is None
    assert model.inputs == ("train.disturbance", "target.value")
    assert model.outputs == ("train.position", "train.speed")
    assert pick(model, "train.position", "train.speed") == pytest.approx(np.array([[0, 1], [0, -ALPHA]]), abs=1e-15)
    v = model.states.index("train.speed")
    assert model.b[v] == pytest.approx([1.0, ALPHA], abs=1e-15)
    assert model.c[1, v] == 1.0
    assert not model.d.any()
    poles = sorted(np.linalg.eigvals(model.a).real)
    assert poles == pytest.approx([-0.25] * 3 + [-ALPHA, 0.0, 0.0], abs=1e-12)
    assert model.values["train.speed"] == pytest.approx(8.0 - 3.0 * (1.0 - ALPHA * STEP) ** 2, abs=1e-12)


def test_one_step_of_one_train_is_that_of_held_forces():
    """v+ = v + h alpha (target - v), x+ = x + h v + h^2/2 alpha (target - v): z = 1 - alpha h."""
    model = linearize(one_train(), 1.0, sampled=True)
    x, v = STEP**2 / 2 * ALPHA, STEP * ALPHA
    expected = np.array([[1.0, STEP - x], [0.0, 1.0 - v]])
    assert pick(model, "train.position", "train.speed") == pytest.approx(expected, abs=1e-14)
    assert model.b[model.states.index("train.speed")] == pytest.approx([STEP, v], abs=1e-14)
    assert model.step == STEP


@pytest.mark.parametrize(
    ("algorithm", "delay", "age"), [("jacobi", 0, 1), ("gauss-seidel", 1, 1), ("gauss-seidel", 2, 2), ("jacobi", 1, 2)]
)
def test_a_late_force_is_a_register(algorithm, delay, age):
    """v_k+1 = v_k - alpha h v_k-age: z^(age+1) - z^age + alpha h = 0."""
    model = linearize(one_train(algorithm, delay), 1.0, sampled=True)
    expected = np.roots([1.0, -1.0, *[0.0] * (age - 1), ALPHA * STEP])
    found = np.linalg.eigvals(model.a)
    assert all(np.abs(found - z).min() < 1e-9 for z in expected)
    assert sum("recorded" in name or "earlier" in name for name in model.states) == age


def test_a_delay_asks_for_the_model_of_a_step():
    model = linearize(one_train(delay=1), 1.0)
    assert model.step == STEP
    assert any("delayed: train.force" in note for note in model.notes)


# ---------------------------------------------------------------- memory, and the three kinds


@pytest.fixture
def pi_loop(components):
    system = System(stop_time=10.0, step=STEP)
    system.add("train", "PointMassTrain", mass=1.0, speed=5.0, **FREE)
    system.add("pi", components(PI)("Pi"))
    system.add("target", "Schedule", values=8.0)
    system.connect("train.speed", "pi.speed")
    system.connect("target.value", "pi.target")
    system.connect("pi.force", "train.force")
    return system


@pytest.mark.parametrize("kind", ["native", "python", "plain"])
def test_memory_is_a_state_of_the_step(pi_loop, kind):
    """v+ = v + h (kp (r - v) + ki I), I+ = I + h (r - v), by hand; native, Python and plain alike."""
    if kind == "native" and importlib.util.find_spec("casadi") is None:
        pytest.skip("casadi is not installed")
    model = linearize(pi_loop, 2.0, kind=kind)
    expected = np.array([[1.0 - STEP * 0.3, STEP * 0.05], [-STEP, 1.0]])
    assert pick(model, "train.speed", "pi.total") == pytest.approx(expected, abs=1e-9)
    at = [model.states.index(name) for name in ("train.speed", "pi.total")]
    assert model.b[at, model.inputs.index("target.value")] == pytest.approx([STEP * 0.3, STEP], abs=1e-9)
    assert any("sampled or stepped: " in note and "pi" in note for note in model.notes)
    assert any("is no native FMU here" in note for note in model.notes) == (kind != "native")


def test_a_late_sensor_is_a_register_of_its_own():
    """A sampled block in the loop, one sample late: z^2 - z + alpha h = 0, as for a late force."""
    system = one_train()
    system.connections = [c for c in system.connections if c.target not in ("cruise.position", "cruise.speed")]
    system.add("sensor", "Sensor", delay=1)
    for name in ("position", "speed"):
        system.connect(f"train.{name}", f"sensor.true_{name}")
        system.connect(f"sensor.{name}", f"cruise.{name}")
    found = np.linalg.eigvals(linearize(system, 5.0).a)
    assert all(np.abs(found - z).min() < 1e-9 for z in np.roots([1.0, -1.0, ALPHA * STEP]))


def test_finite_differences_find_slopes_and_hold_what_switches():
    def respond(x):
        return np.array([x[0] ** 3 + 5e4, np.sin(x[1]), np.sign(x[2]), 3.0])

    jacobian, rough = differences(respond, np.array([2.0, 0.5, 0.0]))
    assert jacobian[0, 0] == pytest.approx(12.0, rel=1e-8)
    assert jacobian[1, 1] == pytest.approx(np.cos(0.5), rel=1e-11)
    assert not jacobian[:, 2].any()
    assert rough == [2]


# ---------------------------------------------------------------- feed-through

GAIN = """
class Gain(Base):
    u = Input("1", 0.0)
    extra = Input("1", 0.0, optional=True)
    k = Parameter("1", 1.0)
    y = Output("1")

    def outputs(self):
        return {"y": self.k * self.u + self.extra}
"""


@needs_native
def test_chains_and_loops_of_feed_through_are_solved(components):
    """y1 = 0.5 y2 + e, y2 = -0.8 y1: y1 = e / (1 + 0.4); scaled by the connection's own scale."""
    gain = components(GAIN)("Gain")
    system = System(stop_time=1.0, step=0.1)
    system.add("one", gain, k=0.5)
    system.add("two", gain, k=-0.8)
    system.add("three", gain, k=3.0)
    system.connect("two.y", "one.u")
    system.connect("one.y", "two.u")
    system.connect("one.y", "three.u", scale=10.0)
    model = linearize(system, 0.0, inputs=["one.extra"], outputs=["one.y", "two.y", "three.y"])
    assert model.d[:, 0] == pytest.approx(np.array([1.0, -0.8, 30.0]) / 1.4, abs=1e-14)
    assert any("the algebraic loop through" in note and "is solved" in note for note in model.notes)


# ---------------------------------------------------------------- what a user does wrong


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"at": 0.7}, "0.7 s, is no communication point"),
        ({"at": -1.0}, "no communication point"),
        ({"at": 1.0, "inputs": ["train.disturbanc"]}, "did you mean 'train.disturbance'?"),
        ({"at": 1.0, "outputs": ["train.sped"]}, "did you mean 'train.speed'?"),
    ],
)
def test_wrong_arguments_are_told_in_words(arguments, message):
    with pytest.raises(ScenarioError) as error:
        linearize(one_train(), **arguments)
    assert message in str(error.value)


# ---------------------------------------------------------------- FMUs of other makers

STATEFUL = """
    def _get_fmu_state(self):
        return dict(self.v)

    def _set_fmu_state(self, state):
        self.v.update(state)

    @staticmethod
    def _fmu_state_to_bytes(state):
        import json
        return json.dumps(state).encode()

    @staticmethod
    def _fmu_state_from_bytes(state):
        import json
        return {int(k): x for k, x in json.loads(state).items()}
"""


@pytest.fixture
def swapped(foreign, xml):
    """One train whose force comes from an FMU of another maker: force = gain (8 - speed)."""

    def make(body, simulation=""):
        variable = xml["variable"]
        variables = [variable("speed", "input", start=0.0), variable("force", "output", dependencies=["speed"])]
        path = foreign(variables, body, simulation=simulation)
        system = System(stop_time=10.0, step=STEP)
        system.add("train", "PointMassTrain", mass=1.0, speed=5.0, **FREE)
        system.add("box", path)
        system.connect("train.speed", "box.speed")
        system.connect("box.force", "train.force")
        return system

    return make


REFRESH = "    def refresh(self, v):\n        v[1] = 0.4 * (8.0 - v[0])\n"


def test_without_derivatives_and_saved_states_it_is_refused_with_the_remedy(swapped):
    with pytest.raises(ScenarioError, match=r"box: Foreign can be linearized in no way.*canGetAndSetFMUstate.*--swap"):
        linearize(swapped(REFRESH), 1.0)


def test_with_saved_states_it_is_differentiated_over_a_step(swapped):
    model = linearize(swapped(REFRESH + STATEFUL, 'canGetAndSetFMUstate="true"'), 1.0)
    assert pick(model, "train.speed")[0, 0] == pytest.approx(1.0 - 0.4 * STEP, abs=1e-9)
    assert any("Foreign gives no directional derivatives" in note for note in model.notes)


def test_memory_that_is_not_listed_is_found_out(swapped):
    body = "    def step(self, t, h, v):\n        v[9] = v.get(9, 0.0) + v[0]\n        v[1] = v[9]\n"
    with pytest.raises(ScenarioError, match="remember former inputs"):
        linearize(swapped(body + STATEFUL, 'canGetAndSetFMUstate="true"'), 1.0)


# ---------------------------------------------------------------- responses


@pytest.mark.parametrize("step", [None, 0.5])
def test_the_state_space_has_the_same_numbers_with_and_without_python_control(step, monkeypatch, a_model):
    model = a_model([[-0.5, 0.1], [0.0, -0.2]], [0.5, 1.0], np.eye(2), step=step, outputs=("train[1].speed", "y"))
    spaces = []
    if importlib.util.find_spec("control") is not None:
        spaces.append(model.state_space())
        assert spaces[0].output_labels == ["train[1]_speed", "y"]
        assert spaces[0].dt == (step or 0)
    monkeypatch.setitem(sys.modules, "control", None)
    spaces.append(model.state_space())
    assert type(spaces[-1]).__module__.startswith("scipy")
    for space in spaces:
        assert (model.a == space.A).all()
        assert (model.b == space.B).all()
        assert (model.c == space.C).all()
        assert (model.d == space.D).all()


# ---------------------------------------------------------------- the command


@pytest.fixture(scope="module")
def orchestrate():
    def run(*arguments):
        return CliRunner().invoke(app, [str(argument) for argument in arguments])

    return run


@needs_native
@pytest.mark.long
def test_the_command_answers_and_leaves_its_numbers_and_figures(orchestrate, tmp_path):
    done = orchestrate("linearize", "comfort_cruise", "--at", "60", "-o", tmp_path)
    assert done.exit_code == 0, done.output
    assert "stable: every deviation decays, but for 1 mode that nothing pulls back (train[1–4].position)" in done.output
    assert "string stable under train[1].disturbance" in done.output
    content = json.loads((tmp_path / "linear.json").read_text())
    n = len(content["states"])
    assert np.array(content["A"]).shape == (n, n)
    assert content["verdict"] == "stable"
    figures = {path.name for path in tmp_path.glob("*.png")}
    steps = {"step-train-1-disturbance.png", "step-target-value.png"}
    assert figures == {"eigenvalues.png", "bode.png", "string-stability.png", *steps}


def test_an_unstable_loop_ends_with_1(orchestrate, tmp_path):
    """The law's force with its sign turned by the connection: dv/dt = -alpha (target - v)."""
    (tmp_path / "runaway.toml").write_text(
        '[simulation]\nstop_time = 5.0\n[instances.train]\ncomponent = "PointMassTrain"\nstart.speed = 8.0\n'
        '[instances.cruise]\ncomponent = "ComfortCruise"\nstart.target_speed = 8.0\n'
        '[connections]\n"cruise.position" = "train.position"\n"cruise.speed" = "train.speed"\n'
        '"train.force" = { from = "cruise.force", scale = -1.0 }\n'
    )
    arguments = ("linearize", tmp_path / "runaway.toml", "--at", "1", "--no-figures", "-o", tmp_path)
    done = orchestrate(*arguments)
    assert done.exit_code == 1
    assert "unstable: 1 mode grows" in done.output
    assert orchestrate(*arguments, "--quiet").output == ""


@needs_native
def test_whole_numbers_reach_their_inputs_after_compiled_steps():
    """CAILC takes the trip's number: what the kernel leaves as doubles must be whole again for calls from Python."""
    system = load("cailc")
    model = linearize(system, 20 * system.stepping.step, kind="native")
    assert np.isfinite(model.a).all()
    assert model.values["train.position"] == run(system, stop_time=20 * system.stepping.step)["train.position"][-1]


@needs_native
def test_isolated_instances_give_the_same_model():
    system = load("comfort_cruise")
    plain, isolated = linearize(system, 1.0), linearize(isolate(system, ["train"]), 1.0)
    assert (plain.a.tolist(), plain.b.tolist()) == (isolated.a.tolist(), isolated.b.tolist())
    assert plain.values == isolated.values


def test_a_step_that_meets_no_sample_has_no_model(pi_loop):
    pi_loop.instances["pi"].start["sample_time"] = 0.3
    with pytest.raises(ScenarioError, match=r"not a whole multiple of its sample_time 0\.3 s; set step or pi\.sample"):
        linearize(pi_loop, 0.0, kind="plain")
