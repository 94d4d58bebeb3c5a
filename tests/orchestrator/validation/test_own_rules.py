"""What our own FMUs keep, in either version of FMI: whole, and with each part taken out of them."""

import re
from dataclasses import replace

import pytest
from railcosim.components import Consist, Gust, PointMassTrain
from railcosim.fmus.description import companions, write
from railcosim.orchestrator.fmi.reader import read_interface
from railcosim.orchestrator.validation.own_rules import broken_rules


@pytest.fixture
def broken(tmp_path):
    """The broken rules of a description made here, with texts in it replaced, and parts left out."""

    def judge(component, fmi, *replaced, without=(), kind="native"):
        text = write(component, kind, "ab" * 32, fmi=fmi).decode()
        for old, new in replaced:
            text, count = re.subn(old, new, text)
            assert count, old
        files = {
            "modelDescription.xml": text.encode(),
            "documentation/index.html": b"x",
            "sources/all.c": b"x",
            "sources/buildDescription.xml": companions(component, b"")["sources/buildDescription.xml"],
        }
        for name, content in files.items():
            if name not in without:
                (tmp_path / name).parent.mkdir(exist_ok=True)
                (tmp_path / name).write_bytes(content)
        return broken_rules(tmp_path, read_interface(tmp_path, "it.fmu"))

    return judge


@pytest.mark.parametrize("fmi", ["2", "3"])
@pytest.mark.parametrize("component", [PointMassTrain, Consist])
def test_ours_keep_them(broken, component, fmi):
    assert broken(component(), fmi) == []


def test_a_python_fmu_has_fewer(broken):
    assert broken(PointMassTrain(), "2", kind="python") == []


@pytest.mark.parametrize(
    ("fmi", "old", "new", "rule"),
    [
        ("2", ' canSerializeFMUstate="true"', "", "canSerializeFMUstate is not declared"),
        ("2", ' canInterpolateInputs="true"', "", "canInterpolateInputs is not declared"),
        ("3", ' canSerializeFMUState="true"', "", "canSerializeFMUState is not declared"),
        ("2", "(?s)<SourceFiles>.*?</SourceFiles>", "", "no source files are listed"),
        ("2", "(?s)<Derivatives>.*?</Derivatives>", "", "der(speed) is missing from the derivatives in ModelStructure"),
        ("3", "<ContinuousStateDerivative.*?/>", "", "der(speed) is missing from the derivatives in ModelStructure"),
        ("3", "<InitialUnknown .*?/>", "", "speed is calculated and missing from InitialUnknowns"),
        (
            "2",
            "<InitialUnknowns>\\s*<Unknown index=.*?/>",
            '<InitialUnknowns><Unknown index="x"/>',
            "is calculated and",
        ),
        ("3", '(<InitialUnknown valueReference="\\d+") dependencies=".*?"', r"\1", "lists no dependencies in Initial"),
        ("3", '(<Output valueReference="\\d+") dependencies=".*?"', r"\1", "the output speed lists no dependencies"),
        ("2", ' description="speed"', "", "speed has no description"),
        ("2", '(name="mass".*?) variability="fixed"', r'\1 variability="constant"', "is neither fixed nor tunable"),
        (
            "3",
            '(name="speed".*?) initial="calculated"',
            r'\1 initial="calculated" start="1"',
            "a start value all the same",
        ),
        ("2", '<BaseUnit kg="1" m="1" s="-2"/>', "", "the unit 'N' is not defined by base units"),
        ("2", "<DefaultExperiment.*?/>", "", "there is no DefaultExperiment"),
        ("3", "<fmiModelDescription", '<fmiModelDescription generationDateAndTime="2020-01-01T00:00:00Z"', "the date"),
    ],
)
def test_a_rule_that_is_broken_is_told(broken, fmi, old, new, rule):
    assert any(rule in sentence for sentence in broken(PointMassTrain(), fmi, (old, new)))


@pytest.mark.parametrize(
    ("fmi", "missing", "rule"),
    [
        ("2", "sources/all.c", "sources/all.c is listed and missing"),
        ("3", "sources/all.c", "sources/all.c is listed and missing"),
        ("3", "sources/buildDescription.xml", "no source files are listed"),
        ("2", "documentation/index.html", "documentation/index.html is missing"),
    ],
)
def test_what_the_archive_lacks_is_told(broken, fmi, missing, rule):
    assert broken(PointMassTrain(), fmi, without=[missing]) == [rule]


def test_none_of_ours_is_of_fmi_1(tmp_path, broken):
    broken(PointMassTrain(), "2")
    old = read_interface(tmp_path, "it.fmu")

    assert broken_rules(tmp_path, replace(old, version="1.0")) == ["it says that it is one of ours, but is of FMI 1.0"]


def test_a_block_without_real_inputs_takes_no_derivatives_of_them(broken):

    assert broken(Gust(), "2") == []
