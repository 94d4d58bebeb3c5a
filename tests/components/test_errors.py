"""What is suggested for a misspelt name."""

from railcosim.components.errors import did_you_mean, nearest


def test_the_nearest_name_is_suggested_or_nothing():
    assert did_you_mean("spede", ["position", "speed", "spread"]) == "; did you mean 'speed'?"
    assert did_you_mean("zzz", ["position", "speed"]) == ""
    assert did_you_mean("spede", iter(())) == ""


def test_how_near_a_name_must_be_is_the_callers():
    assert did_you_mean("pos", ["position"], cutoff=0.5) == "; did you mean 'position'?"
    assert did_you_mean("pos", ["position"]) == ""


def test_without_a_near_name_all_are_listed_in_order():
    assert nearest("spede", ["position", "speed"]) == "'spede'; did you mean 'speed'?"
    assert nearest("zzz", iter(["speed", "position"])) == "'zzz'; it has position, speed"
