"""The page of each component: complete, the same each time, and what it advises works."""

import re
from xml.etree import ElementTree

import pytest
from railcosim.components import CATALOGUE, AtoController, ComfortCruise, CruiseController, Train
from railcosim.components.declarations import Data, Size
from railcosim.orchestrator import load
from railcosim.orchestrator.fmi import Workspace
from railcosim.orchestrator.run import check

NAMES = list(CATALOGUE)


@pytest.fixture
def without_figure(component_page, monkeypatch):
    monkeypatch.setattr(component_page, "draw", lambda component: ("<svg/>", "A caption."))
    return component_page


@pytest.mark.parametrize("name", NAMES)
def test_a_page_tells_all_that_is_declared(without_figure, name):
    cls = CATALOGUE[name]
    page = without_figure.page(cls)
    rows = set(re.findall(r"^\| `(\w+)` \|", page, re.MULTILINE))
    arguments = {key for key, declaration in cls.declarations.items() if isinstance(declaration, Size | Data)}
    assert rows == {slot.name for slot in cls().slots.values() if type(slot.declaration).__name__ != "Tape"} | arguments
    assert all(equation in page for equation in cls.equations)
    assert cls.note in page
    assert f"**Source:** {cls.source or 'own'}." in page


def test_a_row_of_each_table_by_hand(without_figure):
    page = without_figure.page(ComfortCruise)
    assert "| `ahead_speed` | m/s | 0 | yes | speed of the train ahead |" in page
    assert "| `beta` | 1/s | 0.0342857 | ≥ 0 | yes | gain on speed differences to the neighbours |" in page
    degraded = "`has_ahead`, `has_behind`, `has_leader`, `ahead_age`, `behind_age`, `leader_age`"
    assert f"| `degraded` | boolean | {degraded} | whether a neighbour's data is too old to be extrapolated |" in page


def test_a_long_start_value_is_cut_and_an_array_shows_its_shape(without_figure):
    page = without_figure.page(CATALOGUE["SubwayTrain"])
    assert re.search(r"\| `vehicle_force` \| N \| 6 \|", page)
    assert re.search(r"^\| `consist` \| `.{60} …` \|", page, re.MULTILINE)


def test_ports_are_the_abstract_classes_that_declare_the_inputs(component_page):
    ports = {name: component_page.port(cls) for name, cls in CATALOGUE.items()}
    assert ports["ComfortCruise"] is CruiseController
    assert ports["SubwayTrain"] is ports["PointMassTrain"] is Train
    assert ports["Cailc"] is AtoController
    assert ports["Gust"] is None


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_the_swap_that_a_page_advises_is_one_that_the_scenario_takes(without_figure, name, session_cache, monkeypatch):
    monkeypatch.setenv("RAILCOSIM_CACHE", str(session_cache))
    advised = re.findall(r"^orchestrate run (\w+) --swap (\S+)$", without_figure.page(CATALOGUE[name]), re.MULTILINE)
    for scenario, swap in advised:
        system = load(scenario, swaps=[swap])
        with Workspace() as workspace:
            check(system, workspace, "plain")
        assert name in {instance.model for instance in system.instances.values()}


def test_most_of_those_that_share_a_port_are_advised_a_swap(without_figure):
    advised = {name for name, cls in CATALOGUE.items() if "--swap" in without_figure.page(cls)}
    assert {
        "ComfortCruise",
        "TunablePotentialCruise",
        "SubwayTrain",
        "PidAto",
        "BacksteppingCruise",
    } <= advised
    assert not {"Gust", "Line", "StateFaultObserver"} & advised


@pytest.mark.parametrize("name", ["Gust", "ComfortCruise", "RadioLink", "Cailc"])
def test_a_figure_is_drawn_in_the_colour_of_the_text_and_the_same_each_time(component_page, name):
    first, caption = component_page.draw(CATALOGUE[name]())
    assert (first, caption) == component_page.draw(CATALOGUE[name]())
    assert caption == component_page.EXPERIMENTS[name]["caption"]
    ElementTree.fromstring(first.replace("xlink:", ""))
    assert "currentColor" in first
    assert "#010203" not in first
    assert not re.search(r"(#ffffff|#000000|white|black)", first)


def test_every_experiment_is_one_of_a_component(component_page):
    assert set(component_page.EXPERIMENTS) <= set(NAMES)


def test_a_component_without_an_experiment_is_shown_under_the_excitation_of_its_reference_signals(
    component_page, monkeypatch
):
    monkeypatch.delitem(component_page.EXPERIMENTS, "PointMassTrain")
    figure, caption = component_page.draw(CATALOGUE["PointMassTrain"]())
    assert "every real input swings" in caption
    assert all(f">{name}<" in figure for name in ("position", "speed", "acceleration", "applied_force"))


def test_signals_are_constants_lines_with_jumps_or_one_for_each_element(component_page):
    signal = component_page._signal
    assert signal(3.0)(17.0) == 3.0
    line = signal([[0, 0], [10, 20], [10, 5], [20, 5]])
    assert (line(5.0), line(10.001), line(30.0)) == (10.0, 5.0, 5.0)
    assert signal([[[0, 0], [10, 20]], 7.0])(5.0) == [10.0, 7.0]
