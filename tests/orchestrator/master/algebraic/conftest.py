"""What the tests of algebraic loops in the compiled loop share: an FMU by hand, two of it, and what a run comes to."""

import fmpy
import pytest
from railcosim.orchestrator.errors import RunError
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.system import System


@pytest.fixture
def bent(compile_c, xml, tmp_path):
    """The FMU of bent.c."""

    def make(*options, derives=True):
        v, whole = xml["variable"], {"variability": "discrete"}
        shown = [v("u", "input", start=0.0), v("v", "input", start=0.0)]
        shown += [v("y", "output", dependencies=["u", "v"]), v("z", "output", dependencies=["u", "v"])]
        shown += [v(name, "parameter", start=0.0, variability="tunable") for name in ("a", "b", "c")]
        shown += [v(name, "parameter", "Integer", 0, variability="tunable") for name in ("f", "mode")]
        shown += [v("m", "input", "Integer", 0, **whole), v("n", "output", "Integer", dependencies=["m"], **whole)]
        able = f'canHandleVariableCommunicationStepSize="true" providesDirectionalDerivative="{str(derives).lower()}"'
        files = {
            "modelDescription.xml": xml["description"](shown, identifier="Bent", simulation=able),
            f"binaries/{fmpy.platform}/Bent{fmpy.sharedLibraryExtension}": compile_c("bent.c", *options),
        }
        return str(xml["write_archive"](tmp_path / f"bent{len(list(tmp_path.iterdir()))}.fmu", files))

    return make


@pytest.fixture
def coupled():
    """Makes systems of two FMUs: y of each is u of the other one, and v of both is 0.25 of y of the first one."""

    def make(model, first, second, stop=2.0, **how):
        system = System(**{"stop_time": stop, "step": 0.25, "algebraic_loops": "solve"} | how)
        for name, start in (("p", first), ("q", second)):
            system.add(name, model, **start)
        system.connect("p.y", "q.u")
        system.connect("q.y", "p.u")
        for name in "pq":
            system.connect("p.y", f"{name}.v", scale=0.25)
        return system

    return make


@pytest.fixture
def looped_arrays(arrays):
    """A system of the FMU of arrays3.c, elements of which lead into others."""
    texts = '<String name="copies" valueReference="10" causality="output"><Dimension start="2"/></String>'
    system = System(stop_time=1.0, step=0.25, algebraic_loops="solve")
    path = arrays((texts, ""), ('<Output valueReference="10"/>', ""))
    system.add("it", str(path), **{f"k[{k}]": 1.0 for k in (1, 2, 3)})
    system.connect("it.z", "it.u[1,1]", scale=0.5)
    system.connect("it.z", "it.u[1,2]", scale=-3.0)
    system.connect("it.y[1,3]", "it.u[1,3]", scale=0.25, offset=0.5)
    for k in (2, 1):
        system.connect(f"it.y[2,{k}]", f"it.u[2,{3 - k}]", scale=-0.75 * k, offset=1.0)
    system.connect("it.y[2,3]", "it.u[2,3]", scale=3.0, offset=1.0)
    return system


@pytest.fixture
def varying(mine):
    """Makes systems in steps that vary: y = -3 y + t, and what y leads to, a lag or another FMU."""

    def make(last=None, start=0.0, stop=2.0, **how):
        system = System(start_time=start, stop_time=stop, algorithm="adaptive", algebraic_loops="solve", **how)
        system.add("a", mine("Affine"), gain=-3.0)
        system.add("b", mine("Affine"))
        system.add("clock", mine("Clock"))
        system.add("last", last or mine("Lag"))
        for source, target in (("a.y", "b.u"), ("b.y", "a.u"), ("clock.t", "a.w"), ("a.y", "last.u")):
            system.connect(source, target)
        return system

    return make


@pytest.fixture
def unsolvable(mine):
    """A system in steps that vary: -t + 12, 10 more while that is below 4.5. No answer is right from 7.5 s on."""
    system = System(start_time=5.0, stop_time=8.0, step=0.25, algorithm="adaptive", algebraic_loops="solve")
    system.add("switch", mine("Switch"))
    system.add("level", mine("Level"), level=4.5, upside_down=True)
    system.add("bend", mine("Affine"), gain=-1.0)
    system.add("clock", mine("Clock"))
    system.add("lag", mine("Lag"))
    system.connect("clock.t", "bend.u", offset=-12.0)
    for source, target in (("bend.y", "switch.w"), ("switch.y", "level.u"), ("level.on", "switch.on")):
        system.connect(source, target)
    system.connect("switch.y", "lag.u")
    return system


@pytest.fixture
def outcome(contents):
    """What a run of a system comes to: its values, what it fails of, what it counts."""

    def go(system, **how):
        try:
            result, error = run(system, **how), None
        except RunError as failure:
            result, error = failure.run, failure
        known = error and (str(error), *(getattr(error, name, None) for name in ("instance", "time", "status", "log")))
        return contents(result), known, result.coupling

    return go
