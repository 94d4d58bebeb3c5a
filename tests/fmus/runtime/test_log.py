"""log.c: what is told to the importer, and how."""

from ctypes import c_char_p, c_size_t
from pathlib import Path

OTHERS = Path(__file__).parents[2] / "components" / "samples.py"
LEARNER = f"{OTHERS}:Learner"
OK = 0
ERROR = 3
NULL = None


# ---------------------------------------------------------------- messages


def test_events_are_told_only_while_logging_is_on(load):
    fmu = load("Gust")
    fmu.initialize()
    assert not fmu.messages
    loud = load("Gust", logging=True).initialize()
    assert [m[2] for m in loud.messages] == ["logEvents", "logEvents"]

    def categories(on, *names):
        return loud.SetDebugLogging(on, c_size_t(len(names)), (c_char_p * len(names))(*names) if names else NULL)

    for on, names, told in (
        (1, (), True),
        (0, (), False),
        (1, (b"logStatusError",), False),
        (1, (b"logStatusError", b"logEvents"), True),
        (1, (b"logEvents", b"logStatusError"), True),
        (0, (b"logEvents",), False),
        (1, (b"logAll",), True),
        (0, (b"logAll",), False),
    ):
        assert categories(on, *names) == OK
        loud.messages.clear()
        loud.Reset()
        loud.initialize()
        assert bool(loud.messages) == told
    assert categories(1, b"logEverything") == ERROR
    assert "logEverything" in loud.said
    assert loud.SetDebugLogging(1, c_size_t(1), NULL) == ERROR
    assert categories(1, NULL) == ERROR
    declared = {c.get("name") for c in model_xml(loud).iter("Category")}
    assert declared == {"logAll", "logStatusError", "logStatusWarning", "logEvents"}


def model_xml(fmu):
    from lxml import etree

    (path,) = Path(fmu.library._name).parents[2].glob("modelDescription.xml")
    return etree.parse(path).getroot()


def test_percent_and_number_signs_reach_the_importer_doubled(load, tmp_path):
    """The message is a printf format, and #r12# in it would be replaced by a variable's name."""
    fmu = load(LEARNER, name="50%s#r1#")
    path = tmp_path / "100%d#n" / "tape"
    fmu.initialize(sample_time=0.1, tape_file=str(path))
    assert fmu.Terminate() == ERROR
    assert fmu.messages[-1][0] == "50%s#r1#"
    assert "100%%d##n" in fmu.said
    assert "100%d#n" in fmu.said.replace("%%", "%").replace("##", "#")
