"""What the tests of the compiled loop share: how often it was used, its results and those of Python, a ring."""

import ctypes
import importlib.util
import shutil
import subprocess
import sysconfig
from pathlib import Path
from types import SimpleNamespace

import fmpy
import numpy as np
import pytest
from railcosim.orchestrator.errors import RunError
from railcosim.orchestrator.isolation import HAS_LANES, instantiate, isolate, process
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.master.compiled import CompiledLoop
from railcosim.orchestrator.master.loop import Master
from railcosim.orchestrator.master.plans import CHANGES, CONTROL, PLACE
from railcosim.orchestrator.run.checking import check
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.system import System

_NATIVE = Path(__file__).parents[3] / "orchestrator" / "master" / "native"
_SCARCE = Path(__file__).parents[2] / "scarce.h"


@pytest.fixture(scope="session")
def compile_kernel():
    """Compile the step loop to a file, without a warning."""

    def make(target, *flags):
        command = [
            shutil.which("gcc"),
            *["-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror", "-ffp-contract=off"],
        ]
        command += ["-shared", "-fPIC", f"-I{sysconfig.get_paths()['include']}", *flags, *sorted(_NATIVE.rglob("*.c"))]
        subprocess.run([*command, "-o", target], check=True)
        return target

    return make


@pytest.fixture(scope="session")
def scarce_kernel(compile_kernel, tmp_path_factory):
    """A kernel that can be refused what it asks for, and the number of times that it is granted."""
    if not hasattr(ctypes.CDLL(compiled.kernel.__file__), "scarce_left"):
        target = tmp_path_factory.mktemp("scarce") / "kernel.so"
        library = compile_kernel(target, "-O0", "-pthread", "-include", _SCARCE)
    else:  # the one in use can, in measure_coverage.py
        library = compiled.kernel.__file__
    spec = importlib.util.spec_from_file_location("railcosim.orchestrator.master.kernel", library)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module, ctypes.c_int.in_dll(ctypes.CDLL(library), "scarce_left")


NAMES = (
    "operations parts channels instances entries references forms courses notes loops solvers parties terms "
    "passed points states work stamps "
    "changes kept values history newest table row places "
    "disturbed control texts every start step first count last"
)


@pytest.fixture
def used(monkeypatch):
    """How many blocks the kernel took."""
    kernel, calls = compiled.kernel, []

    def counted(*arguments):
        calls.append(arguments)
        return kernel.run(*arguments)

    monkeypatch.setattr(compiled, "kernel", SimpleNamespace(run=counted, HAS_THREADS=compiled.kernel.HAS_THREADS))
    return calls


@pytest.fixture
def both(monkeypatch, used):
    """Run a system twice, compiled and in Python; gives the first result when the two are the same to the bit.

    What FMUs have said is the same as well, unless it is said not to be.
    """

    def go(system, *, log=True, **how):
        fast = _attempt(system, **how)
        assert used, "the kernel was not used"
        with monkeypatch.context() as patch:
            patch.setattr(compiled, "kernel", None)
            slow = _attempt(system, **how)
        assert _described(fast.error, log) == _described(slow.error, log)
        assert fast.status == slow.status
        assert _contents(fast) == _contents(slow)
        return fast

    return go


@pytest.fixture(params=["here", "isolated"])
def anywhere(request, both, in_time, nothing_left):
    """As `both`, and with all instances isolated, where it is the same as without that."""
    if request.param == "here":
        return both
    if not HAS_LANES:
        pytest.skip("there are no lanes here")

    def go(system, **how):
        apart = both(isolate(system, ["together"]), **how)
        known = _attempt(system, **how)
        assert _described(apart.error, log=True) == _described(known.error, log=True)
        assert apart.status == known.status
        assert _contents(apart) == _contents(known)
        return apart

    return go


def _attempt(system, **how):
    try:
        return run(system, **how)
    except RunError as error:
        return error.run


def _described(error, log):
    what = str(error) if log else str(error).partition("\n")[0]
    return error and (what, *(getattr(error, name, None) for name in ("instance", "time", "status", "log")[: 3 + log]))


@pytest.fixture(scope="session")
def contents():
    """All that a result holds, as bytes."""
    return _contents


def _contents(result):
    columns = [("time", result.time), *((name, result[name]) for name in result.names())]
    return [(name, column.tolist() if column.dtype == object else column.tobytes()) for name, column in columns]


@pytest.fixture
def hurried(monkeypatch):
    """Most calls of isolated instances come to be waited for outside the compiled loop."""
    made, changed = process.lane.Lane, SimpleNamespace(**vars(process.lane))
    changed.Lane = lambda memory, offset, line, _, *others: made(memory, offset, line, 2e-6, *others)
    monkeypatch.setattr(process, "lane", changed)


@pytest.fixture(scope="session")
def ring():
    """Makes systems of instances in a ring, in every type an FMU of odd.c has."""

    def make(model, count, stop=10.0, **how):
        system = System(**{"stop_time": stop, "step": 0.25, "algorithm": "jacobi"} | how)
        for k in range(count):
            system.add(f"odd[{k}]", model)
        for k in range(count):
            before, own = f"odd[{k - 1 if k else count - 1}]", f"odd[{k}]"
            system.connect(f"{before}.x", f"{own}.u", offset=1.0 + 0.1 * k)
            system.connect(f"{before}.n", f"{own}.m", delay=1)
            system.connect(f"{before}.off", f"{own}.on")
        return system

    return make


@pytest.fixture
def instantiated(workspace):
    """Makes the instances of a system, ready to step; given back at the end."""
    made = []

    def make(system):
        checked = check(system, workspace)
        slaves = dict(instantiate(checked.models, system.instances))
        made.extend(slaves.values())
        master = Master(
            slaves, checked.order.sequence, checked.wiring.links, checked.wiring.starts, system.stepping.algorithm
        )
        master.initialize(system.stepping.start_time, 1e9)
        return master

    yield make
    for slave in made:
        slave.free()


@pytest.fixture
def arguments(workspace, odd, ring, instantiated):
    """What the kernel is called with for a ring, by name; its steps do not vary."""
    master = instantiated(ring(odd, 3))
    plan = [array.copy() for array in CompiledLoop(master.coupling, master.algorithm).plan.arrays]
    values = np.array(master.values)
    changes = np.zeros(1, CHANGES)
    table, kept = np.empty((len(values) + 1, 8)), np.arange(len(values))
    places = np.array([(0, -1, 0)], PLACE)
    disturbed = np.zeros(len(plan[0]), np.int64)
    state = values, np.tile(values, (2, 1)), 1, table, 0, places, disturbed
    given = [*plan, changes, kept, *state, np.zeros(0, CONTROL), None, 1, 0.0, 0.25, 0, 4, 4]
    yield dict(zip(NAMES.split(), given, strict=True))
    for slave in master.slaves.values():
        slave.free()


def _lines(version, negated):
    """What takes texts out of fmi1.xml or fmi3.xml, and there what is another's with its sign changed."""
    if version == 3:
        yield '<String name="said" valueReference="111" causality="output"/>'
        yield '<Binary name="blob" valueReference="121" causality="output"/>'
        for reference in (111, 121):
            yield from (f'    <{kind} valueReference="{reference}"/>\n' for kind in ("Output", "InitialUnknown"))
        return
    lines = {
        "word": 'causality="input" variability="discrete"><String start=""/>',
        "said": 'causality="output" variability="discrete"><String/>',
        "minus_x": 'causality="output" alias="negatedAlias"><Real unit="m"/>',
        "neither": 'causality="output" variability="discrete" alias="negatedAlias"><Boolean/>',
    }
    references = {"word": 0, "said": 1, "minus_x": 1, "neither": 1}
    for n in ("word", "said") if negated else lines:
        yield f'<ScalarVariable name="{n}" valueReference="{references[n]}" {lines[n]}</ScalarVariable>'


@pytest.fixture
def plainly(by_hand):
    """The FMU of fmi1.c or fmi3.c without texts, nor what is the negative of another variable unless it is wanted."""

    def pack(version, *changes, negated=False, **how):
        return str(by_hand(version, *((line, "") for line in _lines(version, negated)), *changes, **how))

    return pack


@pytest.fixture
def first(plainly):
    return plainly(1)


@pytest.fixture
def third(plainly):
    return plainly(3)


@pytest.fixture
def lagging(plainly):
    """Makes systems of two FMUs of fmi1.c or fmi3.c in a cycle, in which b has what a gives in other types as well."""
    typed = {1: "m n off on shown gear", 3: "g f o8 i8 uo16 ui16 o64 i64 shown gear off on"}

    def make(version, **how):
        system = System(**{"stop_time": 8.0, "step": 0.25, "tolerance": 1e-3} | how)
        path = plainly(version)
        system.add("a", path, x=2.0)
        system.add("b", path)
        system.connect("a.x", "b.u", scale=0.5)
        system.connect("b.x", "a.u", scale=-1.0, offset=2.0)
        names = typed[version].split()
        for source, target in zip(names[::2], names[1::2], strict=True):
            system.connect(f"a.{source}", f"b.{target}")
        return system

    return make


@pytest.fixture
def able(odd_fmu, tmp_path):
    """The FMU of odd.c, of which states can be saved, steps vary and inputs go on."""
    abilities = "canGetAndSetFMUstate", "canHandleVariableCommunicationStepSize", "canInterpolateInputs"
    return odd_fmu(tmp_path, *abilities)


@pytest.fixture
def species(compile_c, xml, tmp_path):
    """The FMU of species.c, whose y is said to depend on the inputs given; None says nothing.

    One that is ``counted`` tells how many states there are of all its instances.
    """

    def make(on, *options, able="", tolerance=None, counted=False, **of):
        v = xml["variable"]
        shown = [v("u", "input", start=0.0), v("y", "output", dependencies=on, **of)]
        shown += [v(name, "parameter", start=0.0) for name in ("a", "b", "c", "d", "start")]
        if counted:
            shown.append(v("states", "output", "Integer", dependencies=[], variability="discrete"))
        all_able = f"canGetAndSetFMUstate canHandleVariableCommunicationStepSize {able}".split()
        said = " ".join(f'{name}="true"' for name in all_able)
        text = xml["description"](shown, identifier="Species", simulation=said)
        if tolerance is not None:
            text = text.replace("<ModelVariables>", f'<DefaultExperiment tolerance="{tolerance}"/><ModelVariables>')
        files = {
            "modelDescription.xml": text,
            f"binaries/{fmpy.platform}/Species{fmpy.sharedLibraryExtension}": compile_c("species.c", *options),
        }
        return str(xml["write_archive"](tmp_path / f"species{len(list(tmp_path.iterdir()))}.fmu", files))

    return make
