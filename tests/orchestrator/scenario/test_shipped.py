"""The list of shipped scenarios, which is read without checking them."""

from railcosim.orchestrator.scenario import listed, load


def test_what_is_listed_is_what_is_loaded():
    found = listed()
    assert len(found) > 10
    for scenario in found:
        origin = load(scenario.name).provenance
        assert scenario.title == origin.title
        assert tuple(scenario.presets) == origin.presets
        assert {k: v for k, v in scenario.presets.items() if k != origin.default_preset} == origin.preset_descriptions
