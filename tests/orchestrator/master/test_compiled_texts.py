"""Texts in the compiled loop, where each has a number: the same as in Python, whoever gives them."""

import shutil
import sys

import pytest
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.master.compiled import CompiledLoop
from railcosim.orchestrator.master.plans import texts
from railcosim.orchestrator.system import Connection, Event, System

pytestmark = [
    pytest.mark.skipif(compiled.kernel is None, reason="installed without the compiled step loop"),
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="FMUs by hand are compiled for Linux here"),
    pytest.mark.skipif(shutil.which("gcc") is None, reason="FMUs by hand need gcc"),
]


def ring(model, said="said", **how):
    """Of two, in which each gives the other its text."""
    system = System(**{"stop_time": 4.0, "step": 0.25} | how)
    for name, other in ("ab", "ba"):
        system.add(name, model)
        system.connect(f"{other}.{said}", f"{name}.word")
    return system


@pytest.mark.parametrize(
    "how", [{"algorithm": "jacobi"}, {"refresh": True}, {"record": 0.5}, {"algorithm": "iterative"}], ids=str
)
def test_texts_that_become_longer(both, mine, how):
    result = both(ring(mine("EveryType"), **how), kind="python")
    pace = 1 if "algorithm" in how else 2
    assert (result["a.said"][0], result["b.said"][-1]) == ("a", "a" + "b" * 16 * pace)


def test_what_events_make_of_texts(both, mine):
    system = ring(mine("EveryType"))
    system.add("late", mine("EveryType"), word="é")
    system.connect("a.said", "late.word", delay=2)
    system.events += [
        Event("a.said", "override", 1.0, value="ü", duration=0.5),
        Event("b.word", "override", 2.0, value="once", duration=0.25),
        Event("late.word", "connect", 3.0, source=Connection("b.said", "late.word")),
    ]
    result = both(system, kind="python")
    assert "ü" in result["a.said"]
    assert "onceb" in result["b.said"]


SAID = ('"said" valueReference="1"', '"said" valueReference="0"')
"""What is said is the word at once."""


@pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])
def test_texts_of_fmi_1(both, by_hand, algorithm):
    model = str(by_hand(1, (' alias="negatedAlias"', ' alias="alias"'), SAID))
    system = System(stop_time=3.0, step=0.25, algorithm=algorithm)
    system.add("first", model, word="é")
    system.add("second", model)
    system.add("third", model)
    system.connect("first.said", "second.word", delay=2)
    system.connect("second.said", "third.word")
    system.events.append(Event("first.word", "set", 1.0, value=""))
    assert set(both(system)["third.said"]) == {"", "é"}


def test_what_is_cut_in_the_middle_of_a_letter(both, arrays):
    """FMI 3.0 takes whole arrays of texts; this one has room for 99 bytes, and an é needs two."""
    system = System(stop_time=1.0, step=0.25)
    system.add("a", str(arrays()), words=["é" * 60, "x"])
    system.add("b", str(arrays()))
    system.connect("a.copies", "b.words")
    result = both(system)
    assert [result[f"b.copies[{k}]"][-1] for k in (1, 2)] == ["é" * 49 + "\ufffd", "x"]


@pytest.fixture
def begun(monkeypatch):
    """How often texts that nobody needs any more were forgotten, which they are at once."""
    times, anew = [], texts.Texts.begin_anew
    monkeypatch.setattr(texts, "_MANY", 2)
    monkeypatch.setattr(texts.Texts, "begin_anew", lambda self: (times.append(1), anew(self)))
    return times


def test_texts_that_nobody_needs_any_more_are_forgotten(both, mine, begun):
    system = ring(mine("EveryType"), stop_time=10.0)
    system.add("late", mine("EveryType"))
    system.connect("a.said", "late.word", delay=3)
    system.events.append(Event("b.said", "override", 1.0, value="ü", duration=8.0))
    both(system, kind="python")
    assert begun


WITHOUT_BINARY = (
    ('<Binary name="blob" valueReference="121" causality="output"/>', ""),
    *((f'    <{kind} valueReference="121"/>\n', "") for kind in ("Output", "InitialUnknown")),
)
"""What takes from the FMU of fmi3.c the output that is neither a number nor a text."""


@pytest.mark.parametrize("algorithm", ["gauss-seidel", "iterative", "adaptive"])
def test_texts_of_fmi_3_under_every_kind_of_algorithm(both, by_hand, begun, algorithm):
    model = str(by_hand(3, *WITHOUT_BINARY))
    system = System(stop_time=3.0, step=0.25, algorithm=algorithm)
    system.add("a", model, word="é", x=2.0)
    system.add("b", model)
    for one, other in ("ab", "ba"):
        system.connect(f"{one}.x", f"{other}.u")
    system.connect("a.said", "b.word")
    system.events += [
        Event("a.word", "set", 1.0, value="ü"),
        Event("b.word", "override", 2.0, value="x\0y", duration=0.5),
    ]
    assert {"é", "ü", "x"} <= set(both(system)["b.said"])
    assert begun


def test_texts_by_number():
    kernel = compiled.kernel
    table = kernel.texts()
    said = [b"", b"one", "é".encode(), *(b"%d" % k for k in range(1000))]
    assert [kernel.number(table, text) for text in (*said, *said)] == [*range(len(said))] * 2
    assert kernel.count(table) == len(said)
    assert [kernel.text(table, k) for k in range(len(said))] == said
    assert [kernel.text(table, k) for k in (-1.0, 1e9, float("nan"))] == [b""] * 3
    for call in (kernel.count, lambda wrong: kernel.number(wrong, b"x"), lambda wrong: kernel.text(wrong, 0.0)):
        with pytest.raises((ValueError, TypeError)):
            call("no texts")
    with pytest.raises(TypeError):
        kernel.number(table, 1)
    with pytest.raises(TypeError):
        kernel.text(table, "1")


@pytest.mark.parametrize("mode", [33, 43])
def test_texts_that_cannot_be_read_or_set(both, by_hand, mode):
    model = str(by_hand(1, (' alias="negatedAlias"', ' alias="alias"'), SAID))
    system = System(stop_time=6.0, step=0.25)
    system.add("first", model, word="é", mode=mode)
    system.add("second", model)
    system.connect("second.said", "first.word")
    error = both(system).error
    assert (error.instance, error.time) == ("first", 5.0)


def test_memory_for_texts_that_cannot_be_had(scarce_kernel, arrays, instantiated, monkeypatch):
    """Each request in turn is refused: that is told, and what was there stays."""
    kernel, left = scarce_kernel
    monkeypatch.setattr(compiled, "kernel", kernel)
    monkeypatch.setattr(texts, "kernel", kernel)
    table = kernel.texts()
    for k in range(63):
        kernel.number(table, b"%d" % k)
    for granted, ask in [
        *((n, lambda: kernel.number(table, b"new")) for n in range(3)),
        *((n, kernel.texts) for n in range(4)),
    ]:
        left.value = granted
        with pytest.raises(MemoryError):
            ask()
    left.value = -1
    assert (kernel.count(table), kernel.number(table, b"new")) == (64, 64)
    system, refused = System(stop_time=1.0, step=0.25), 0
    system.add("a", str(arrays()))
    system.add("b", str(arrays()))
    system.connect("a.copies", "b.words")
    master = instantiated(system)
    loop, words = CompiledLoop(master.coupling, master.algorithm), master.slaves["a"].channel("String", ["words[1]"])
    for granted in range(100):
        left.value = -1
        words.set([f"{granted} é"])
        left.value = granted
        try:
            assert loop.run(0.0, 0.25, (0, 4, 4), 1, lambda steps, rows: True)
            break
        except MemoryError:
            refused += 1
    left.value = -1
    assert refused > 10
    assert master.values[master.exchange.places["b", "copies[1]"]] == f"{refused} é"
