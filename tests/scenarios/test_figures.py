"""The figures of the shipped scenarios carry the labels that their content has."""

import re

import pytest
from railcosim.components import CATALOGUE
from railcosim.orchestrator import load
from railcosim.orchestrator.fmi import Workspace
from railcosim.orchestrator.run import check
from railcosim.orchestrator.scenario import shipped

STATED = {"Fig. 5: target speed", "Constant time headway, not in the article", "Predictive, not in the article"}
"""Figures beside reconstructed models that show none of them."""


def titles(name):
    return [figure["title"] for figure in load(name).judged.figures]


@pytest.mark.parametrize("name", [name for name, _ in shipped()])
def test_what_is_reconstructed_is_labelled_on_every_figure(name):
    models = {instance.model for instance in load(name).instances.values()}
    if any(CATALOGUE[model].note.startswith("Reconstructed") for model in models):
        assert [title for title in titles(name) if "reconstructed" not in title and title not in STATED] == []


@pytest.mark.parametrize("name", ["cailc", "ato_comparison", "cailc_disturbed"])
def test_figures_of_several_controllers_are_told_from_those_of_one(name):
    """Figs. 3 to 8 and 11 to 13 of Liu and Hou 2020 hold three controllers; 3 is trip 1, and 4, 5 and 11 trip 10."""
    system = load(name)
    for figure in system.judged.figures:
        number = re.match(r"Fig\. (\d+)", figure["title"])
        if number is None or number[1] in ("2", "9", "10"):
            continue
        text = str(figure)
        controllers = {label for label in ("CAILC", "PDILC", "adaptive") if f"'{label}'" in text}
        assert (controllers == {"CAILC"}) == ("CAILC alone" in figure["title"]), figure["title"]
        assert len(controllers) in (1, 3)
        trips = set(re.findall(r"trip_number == (\d+)", text))
        assert trips <= ({"1"} if number[1] == "3" else {"10"})


def test_fig_5_says_whose_gains_and_gust_and_shows_the_command():
    figure = next(f for f in load("comfort_cruise").judged.figures if f["title"].startswith("Fig. 5"))
    assert "{cruise[1].alpha}" in figure["panels"][0]["title"]
    assert "{gust.size}" in figure["panels"][0]["title"]
    assert figure["panels"][1]["y"] == ["cruise[:].demand"]


def test_a_law_in_the_place_of_another_is_told_on_every_figure_and_if_it_is_reconstructed():
    with Workspace() as workspace:
        swapped = check(load("comfort_cruise", swaps=["cruise=RangePotentialCruise"]), workspace, "plain")
        whole = check(load("comfort_cruise"), workspace, "plain")
    remarks = {figure["remark"] for figure in swapped.system.judged.figures}
    assert remarks == {"cruise: RangePotentialCruise (reconstructed)"}
    assert not any("remark" in figure for figure in whole.system.judged.figures)
