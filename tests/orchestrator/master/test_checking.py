"""What is refused, and what is noted, of the way a system is coupled."""

import pytest
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.master import check_threads, checking
from railcosim.orchestrator.run.checking import check, describe_stepping
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.system import System


@pytest.fixture
def ring(mine):
    """Two components in a circle."""

    def make(a="Pass", b="LagWithRow", **how):
        it = System(**{"stop_time": 1.0, "step": 0.1} | how)
        outputs = {"Pass": "y", "LagWithRow": "x", "Keep": "seen"}
        it.add("a", mine(a))
        it.add("b", mine(b))
        it.connect(f"a.{outputs[a]}", "b.u")
        it.connect(f"b.{outputs[b]}", "a.u")
        return it

    return make


def problems(it, workspace):
    with pytest.raises(ScenarioError) as caught:
        check(it, workspace, "plain")
    return [str(problem) for problem in caught.value.problems]


def notes(it, workspace):
    return check(it, workspace, "plain").notes


# -------------------------------------------------------------------- refused


def stranger(foreign, xml, **of):
    v = xml["variable"]
    return foreign([v("u", "input", start=0.0), v("y", "output", dependencies=[])], **of)


def test_iterative_needs_saved_states_in_cycles_only(ring, foreign, xml, workspace):
    it = ring(algorithm="iterative")
    path = stranger(foreign, xml)
    it.add("outside", path)
    it.connect("a.y", "outside.u")
    check(it, workspace, "plain")
    it.add("inside", path)
    it.connect("inside.y", "inside.u")
    (told,) = problems(it, workspace)
    assert told == (
        "inside: in a cycle, and the state that iterative comes back to cannot be saved (canGetAndSetFMUstate is "
        "false); choose gauss-seidel or jacobi, or break the cycle by a delay"
    )
    it.connections[-1].delay = 1
    check(it, workspace, "plain")


@pytest.mark.parametrize(
    ("signal", "told"),
    [
        ("b.z", "simulation.tolerances: 'b.z' is no Real output"),
        ("b.u", "simulation.tolerances: 'b.u' is no Real output"),
        ("c.x", "simulation.tolerances: 'c.x' is no Real output; did you mean 'b.x'?"),
    ],
)
def test_tolerances_of_what_is_not_there(ring, workspace, signal, told):
    (found,) = problems(ring(algorithm="iterative", tolerances={signal: [0.0, 1e-3]}), workspace)
    assert found.startswith(told)


@pytest.mark.parametrize("signal", ["b.x", "b.row", "b.row[2]"])
def test_tolerances_go_by_signal_by_array_and_by_element(ring, workspace, signal):
    check(ring(algorithm="iterative", tolerances={signal: [0.0, 1e-3]}), workspace, "plain")


# -------------------------------------------------------------------- noted


@pytest.mark.parametrize(
    ("how", "told"),
    [
        ({}, "it is solved at initialization and acts one step late from then on; algebraic_loops = 'solve' solves it"),
        ({"algebraic_loops": "solve"}, "it is solved at each communication point"),
        ({"algorithm": "iterative"}, "it is solved by the iterations"),
        ({"algorithm": "iterative", "algebraic_loops": "solve"}, "it is solved at each communication point"),
    ],
)
def test_what_becomes_of_a_loop(ring, workspace, how, told):
    found = [note for note in notes(ring("Pass", "Pass", **how), workspace) if "algebraic" in note]
    assert len(found) == 1
    assert found[0].startswith(f"algebraic loop through a.y, b.y: {told}")


def test_no_loop_no_note(ring, workspace):
    assert notes(ring(), workspace) == ()


def test_long_loops_are_not_listed_in_full(mine, workspace):
    it = System(stop_time=1.0, step=0.1)
    for k in range(9):
        it.add(f"p{k}", mine("Pass"))
    for k in range(9):
        it.connect(f"p{k}.y", f"p{(k + 1) % 9}.u")
    (loop,) = [note for note in notes(it, workspace) if note.startswith("algebraic loop")]
    assert "p5.y and 3 more: it is solved" in loop


# -------------------------------------------------------------------- shown


def test_check_tells_what_iterative_repeats(ring, workspace):
    it = ring(algorithm="iterative")
    it.instances["sampled"] = ring("Keep").instances["a"]
    it.instances["sampled"].name = "sampled"
    it.connect("b.x", "sampled.u")
    lines = describe_stepping(check(it, workspace, "plain"))
    assert lines == [
        "iterative steps first, at the values of the step's begin: sampled",
        "iterative repeats until they agree: a, b",
    ]


def test_check_tells_the_order_of_adaptive(ring, workspace):
    lines = describe_stepping(check(ring("LagWithRow", "Pass", algorithm="adaptive"), workspace, "plain"))
    assert lines == ["adaptive steps in the order: b, a"]


# -------------------------------------------------------------------- threads


def told_of_threads(it, workspace, kind="native", threads=2):
    checked = check(it, workspace, kind)
    return [str(problem) for problem in check_threads(checked.system, checked.models, checked.wiring, threads)]


def test_threads_that_can_act(ring, workspace):
    assert told_of_threads(ring(algorithm="jacobi"), workspace) == []
    assert told_of_threads(ring(), workspace, "plain", threads=1) == []


@pytest.mark.parametrize(
    ("how", "kind", "why"),
    [
        ({"algorithm": "gauss-seidel"}, "native", "the algorithm is gauss-seidel, and jacobi takes them"),
        ({"algorithm": "iterative"}, "native", "the algorithm is iterative, and jacobi takes them"),
        ({"algorithm": "jacobi"}, "plain", "these are Python objects: a, b"),
        ({"algorithm": "jacobi"}, "python", "these run Python, one thread at a time: a, b"),
        ({"algorithm": "jacobi", "refresh": True}, "native", "feed-through is refreshed in one thread"),
    ],
)
def test_threads_that_cannot_act_are_refused(ring, workspace, how, kind, why):
    (told,) = told_of_threads(ring(**how), workspace, kind)
    assert told.startswith(f"threads = 2: they cannot act: {why}; leave threads out")


def test_threads_and_processes(ring, workspace):
    it = ring(algorithm="jacobi")
    it.instances["b"].isolate = True
    (told,) = told_of_threads(it, workspace)
    assert "these run in processes of their own: b;" in told


def test_threads_and_loops_that_are_solved(mine, workspace):
    it = System(stop_time=1.0, step=0.1, algorithm="jacobi", algebraic_loops="solve")
    for name, other in ("ab", "ba"):
        it.add(name, mine("Pass"), gain=0.5)
        it.connect(f"{name}.y", f"{other}.u")
    (told,) = told_of_threads(it, workspace)
    assert "algebraic loops are solved in one thread" in told


def test_threads_and_strangers(mine, foreign, xml, workspace):
    v = xml["variable"]
    it = System(stop_time=1.0, step=0.1, algorithm="jacobi")
    it.add("text", foreign([v("y", "output", "String", start="no")], name="a.fmu"))
    (told,) = told_of_threads(it, workspace)
    assert "there is one instance; these give texts: text;" in told


@pytest.mark.parametrize(("name", "why"), [("HAS_KERNEL", "no compiled kernel"), ("HAS_THREADS", "no threads on this")])
def test_threads_where_there_are_none(ring, workspace, monkeypatch, name, why):
    monkeypatch.setattr(checking, name, False)
    (told,) = told_of_threads(ring(algorithm="jacobi"), workspace)
    assert why in told


def test_a_run_does_not_begin_with_threads_that_cannot_act(ring, tmp_path):
    """What an earlier run left stays."""
    run(ring(), kind="plain", output=tmp_path)
    before = (tmp_path / "run.json").read_bytes()
    with pytest.raises(ScenarioError, match="threads = 2: they cannot act"):
        run(ring(), kind="plain", output=tmp_path, threads=2)
    assert (tmp_path / "run.json").read_bytes() == before
