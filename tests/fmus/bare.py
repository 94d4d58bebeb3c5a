"""One instance of a native FMU behind the bare functions of the standard; every call gives the status."""

import ctypes
import math
from ctypes import byref, c_char_p, c_double, c_int, c_size_t, c_uint, c_void_p

import fmpy
from fmpy.fmi2 import fmi2CallbackFunctions, fmi2CallbackLoggerTYPE, fmi2EventInfo

OK = 0
STEP = 0.25
NULL = None
EXCHANGE, SLAVE = 0, 1


class Fmu:
    """One instance behind the C functions themselves; every call gives the status."""

    def __init__(self, folder, name="it", logging=False, logger=True, kind=SLAVE):
        self.description = fmpy.read_model_description(folder, validate=False)
        (path,) = (folder / "binaries").glob("*/*.so")
        self.library = ctypes.CDLL(str(path))
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.types = {v.name: v.type for v in self.description.modelVariables}
        self.messages = []
        self.callbacks = fmi2CallbackFunctions()
        self._logger = fmi2CallbackLoggerTYPE(self._log)  # kept: C holds no reference
        if logger:
            self.callbacks.logger = self._logger
        self.instance = self.instantiate(name, kind, logging=logging)
        self.time = 0.0

    def _log(self, environment, instance, status, category, message):
        self.messages.append((instance.decode(), status, category.decode(), message.decode()))

    @property
    def said(self):
        """The last message."""
        return self.messages[-1][3] if self.messages else ""

    def instantiate(self, name="it", kind=SLAVE, guid=None, logging=False, callbacks=True):
        create = self.library.fmi2Instantiate
        create.restype = c_void_p
        create.argtypes = [c_char_p, c_int, c_char_p, c_char_p, c_void_p, c_int, c_int]
        guid = self.description.guid if guid is None else guid
        place = ctypes.cast(byref(self.callbacks), c_void_p) if callbacks else NULL
        return create(name if name is NULL else name.encode(), kind, guid.encode(), b"", place, 0, logging)

    def __getattr__(self, name):
        """``fmu.DoStep(...)`` is fmi2DoStep of this instance."""
        function = getattr(self.library, f"fmi2{name}")

        def call(*arguments):
            return function(c_void_p(self.instance), *arguments)

        return call

    def free(self):
        self.library.fmi2FreeInstance(c_void_p(self.instance))
        self.instance = None

    # ------------------------------------------------------------ life cycle

    def enter(self, start=0.0, stop=None):
        self.time = start
        assert self.SetupExperiment(0, c_double(0), c_double(start), int(stop is not None), c_double(stop or 0)) == OK
        assert self.EnterInitializationMode() == OK
        return self

    def initialize(self, start=0.0, stop=None, **starts):
        self.enter(start, stop)
        for name, value in starts.items():  # of a state the start value, which is a parameter
            array, bracket, index = name.partition("[")
            start = f"{array}_start{bracket}{index}"
            assert self.set(start if start in self.references else name, value) == OK, self.said
        assert self.ExitInitializationMode() == OK, self.said
        return self

    def step(self, length=STEP, at=None):
        at = self.time if at is None else at
        status = self.DoStep(c_double(at), c_double(length), 1)
        if status == OK:
            self.time = at + length
        return status

    # ------------------------------------------------------------ values

    def set(self, name, value):
        kind = self.types[name]
        cell = {"Real": c_double, "Integer": c_int, "Boolean": c_int, "String": c_char_p}[kind]
        value = value.encode() if isinstance(value, str) else value
        return getattr(self, f"Set{kind}")((c_uint * 1)(self.references[name]), c_size_t(1), (cell * 1)(value))

    def get(self, name):
        kind = self.types[name]
        cell = ({"Real": c_double, "Integer": c_int, "Boolean": c_int, "String": c_char_p}[kind] * 1)()
        status = getattr(self, f"Get{kind}")((c_uint * 1)(self.references[name]), c_size_t(1), cell)
        assert status == OK, self.said
        return cell[0]

    def set_derivatives(self, name, *values):
        """Time derivatives of an input, from the first."""
        count = len(values)
        references, orders = (c_uint * count)(*[self.references[name]] * count), (c_int * count)(*range(1, count + 1))
        return self.SetRealInputDerivatives(references, c_size_t(count), orders, (c_double * count)(*values))

    def everything(self):
        return {name: self.get(name) for name in self.references}

    def status_of_get(self, name):
        return self.GetReal((c_uint * 1)(self.references[name]), c_size_t(1), (c_double * 1)())

    def directional(self, unknowns, knowns, direction):
        result = (c_double * len(unknowns))()
        status = self.GetDirectionalDerivative(
            (c_uint * len(unknowns))(*(self.references[n] for n in unknowns)),
            c_size_t(len(unknowns)),
            (c_uint * len(knowns))(*(self.references[n] for n in knowns)),
            c_size_t(len(knowns)),
            (c_double * len(knowns))(*direction),
            result,
        )
        return list(result) if status == OK else status

    def last_successful_time(self):
        value = c_double(math.nan)
        assert self.GetRealStatus(2, byref(value)) == OK
        return value.value

    # ------------------------------------------------------------ model exchange

    def numbers(self, name, count=None):
        """States, derivatives, indicators, nominals: all of them, or the status where a call asks for others."""
        known = {"EventIndicators": self.description.numberOfEventIndicators}
        cells = (c_double * (known.get(name, self.description.numberOfContinuousStates) if count is None else count))()
        status = getattr(self, f"Get{name}")(cells, c_size_t(len(cells)))
        return list(cells) if status == OK else status

    def put(self, *states):
        return self.SetContinuousStates((c_double * len(states))(*states), c_size_t(len(states)))

    def event(self, time=None, integrate=True, **inputs):
        """An event, in which inputs may jump: whether states have changed, and the next time event."""
        if time is not None:
            assert self.SetTime(c_double(time)) == OK
            assert self.EnterEventMode() == OK
        for name, value in inputs.items():
            assert self.set(name, value) == OK
        info = fmi2EventInfo()
        assert self.NewDiscreteStates(byref(info)) == OK, self.said
        assert not info.newDiscreteStatesNeeded + info.terminateSimulation + info.nominalsOfContinuousStatesChanged
        if integrate:
            assert self.EnterContinuousTimeMode() == OK
        next_event = info.nextEventTime if info.nextEventTimeDefined else NULL
        return bool(info.valuesOfContinuousStatesChanged), next_event

    # ------------------------------------------------------------ states

    def save(self):
        state = c_void_p()
        assert self.GetFMUstate(byref(state)) == OK
        return state

    def to_bytes(self, state):
        size = c_size_t()
        assert self.SerializedFMUstateSize(state, byref(size)) == OK
        content = (ctypes.c_char * size.value)()
        assert self.SerializeFMUstate(state, content, size) == OK
        return bytes(content)

    def from_bytes(self, content):
        state = c_void_p()
        status = self.DeSerializeFMUstate(content, c_size_t(len(content)), byref(state))
        return state if status == OK else status
