"""One instance of a native FMU behind the bare functions of FMI 3.0; every call gives the status."""

import ctypes
from ctypes import byref, c_bool, c_char_p, c_double, c_int32, c_size_t, c_uint32, c_void_p

import fmpy
from fmpy.fmi3 import fmi3LogMessageCallback

OK, DISCARD, ERROR, NULL = 0, 2, 3, None
STEP = 0.25
CELLS = {"Float64": c_double, "Int32": c_int32, "Boolean": c_bool, "String": c_char_p}


class Fmu:
    """One instance behind the bare functions of FMI 3.0; every call gives the status."""

    def __init__(self, folder, exchanges=False):
        self.description = fmpy.read_model_description(folder, validate=False)
        (path,) = (folder / "binaries").glob("*/*.so")
        self.library = ctypes.CDLL(str(path))
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.messages = []
        self._logger = fmi3LogMessageCallback(lambda *told: self.messages.append(told))
        self.instance = self.create_for_exchange() if exchanges else self.create()
        self.time = 0.0

    @property
    def said(self):
        return self.messages[-1][3].decode()

    def create(self, name=b"it", token=None, logging=False, events=False, logger=True):
        make = self.library.fmi3InstantiateCoSimulation
        make.restype = c_void_p
        token = self.description.guid.encode() if token is None else token
        listener = (c_void_p(7), self._logger) if logger else (NULL, NULL)
        flags = (c_bool(False), c_bool(logging), c_bool(events), c_bool(True))
        return make(name, token, b"", *flags, NULL, c_size_t(0), *listener, NULL)

    def create_for_exchange(self, name=b"it", token=None, logging=False):
        make = self.library.fmi3InstantiateModelExchange
        make.restype = c_void_p
        token = self.description.guid.encode() if token is None else token
        return make(name, token, b"", c_bool(False), c_bool(logging), c_void_p(7), self._logger)

    def __getattr__(self, name):
        """``fmu.Reset()`` is fmi3Reset of this instance."""
        function = getattr(self.library, f"fmi3{name}")
        return lambda *arguments: function(c_void_p(self.instance), *arguments)

    def enter(self, start=0.0, stop=None):
        told = (c_bool(False), c_double(0), c_double(start), c_bool(stop is not None), c_double(stop or 0.0))
        return self.EnterInitializationMode(*told)

    def initialize(self, **starts):
        for name, value in starts.items():
            assert self.set(name, value) == OK, self.said
        assert self.enter() == OK, self.said
        assert self.ExitInitializationMode() == OK, self.said
        return self

    def step(self, length=STEP):
        told = (c_bool(True), c_bool(True), c_bool(True), c_double())
        status = self.DoStep(c_double(self.time), c_double(length), c_bool(True), *map(byref, told))
        assert not any(flag.value for flag in told[:3])
        self.time += length if status == OK else 0.0
        assert told[3].value == self.time
        return status

    def references(self, *names):
        return (c_uint32 * len(names))(*(self.variables[name].valueReference for name in names)), c_size_t(len(names))

    def size(self, name):
        count = 1
        for dimension in self.variables[name].dimensions:
            count *= int(dimension.start)
        return count

    def get(self, name, count=None, status=OK, again=1):
        """All values of a variable; ``again``: so often in one call."""
        kind, count = self.variables[name].type, self.size(name) * again if count is None else count
        cells = (CELLS[kind] * max(count, 1))()
        told = getattr(self, f"Get{kind}")(*self.references(*[name] * again), cells, c_size_t(count))
        assert told == status, self.said
        return list(cells)

    def set(self, name, *values):
        kind = self.variables[name].type
        given = (CELLS[kind] * max(len(values), 1))(*values)
        return getattr(self, f"Set{kind}")(*self.references(name), given, c_size_t(len(values)))

    def derivative(self, unknowns, knowns, seed, count):
        """The sensitivities, or the status where it is none."""
        found = (c_double * max(count, 1))()
        status = self.GetDirectionalDerivative(
            *self.references(*unknowns), *self.references(*knowns), (c_double * max(len(seed), 1))(*seed),
            c_size_t(len(seed)), found, c_size_t(count),
        )  # fmt: skip
        return list(found)[:count] if status == OK else status

    # ------------------------------------------------------------ model exchange

    def numbers(self, name, count=None):
        """States, derivatives, indicators, nominals: all of them, or the status where a call asks for others."""
        known = {"EventIndicators": self.description.numberOfEventIndicators}
        count = known.get(name, self.description.numberOfContinuousStates) if count is None else count
        cells = (c_double * max(count, 1))()
        status = getattr(self, f"Get{name}")(cells, c_size_t(count))
        return list(cells)[:count] if status == OK else status

    def put(self, *states):
        return self.SetContinuousStates((c_double * max(len(states), 1))(*states), c_size_t(len(states)))

    def update(self, without=()):
        """The status of an update, and what it tells, but for answers that are not asked for."""
        told = (*(c_bool(True) for _ in range(5)), c_double(7.0))
        given = [NULL if k in without else byref(answer) for k, answer in enumerate(told)]
        return self.UpdateDiscreteStates(*given), [answer.value for answer in told]

    def event(self, time=None, integrate=True, **inputs):
        """An event, in which inputs may jump: whether states have changed, and the next time event."""
        if time is not None:
            assert self.SetTime(c_double(time)) == OK
            assert self.EnterEventMode() == OK
        for name, value in inputs.items():
            assert self.set(name, value) == OK
        status, (*never, states_changed, timed, following) = self.update()
        assert (status, never) == (OK, [False] * 3), self.said
        if integrate:
            assert self.EnterContinuousTimeMode() == OK
        return states_changed, following if timed else NULL
