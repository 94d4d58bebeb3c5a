"""What ``orchestrate new`` writes: a controller that runs as it stands, and refusals in words."""

from pathlib import Path

import pytest
from railcosim.components import CruiseController
from railcosim.fmus.references import resolve
from railcosim.orchestrator import ScenarioError
from railcosim.orchestrator.cli.skeleton import write_skeleton


def test_the_formula_of_the_skeleton_is_what_it_says(tmp_path: Path) -> None:
    """demand = gain (v_r - v) + gain / 2 (v_ahead - v), limited: 0.03 * 10 + 0.015 * 2 = 0.33, by hand."""
    path = tmp_path / "my_controller.py"
    assert write_skeleton(path) == "MyController"
    controller = resolve(f"{path}:MyController")
    assert issubclass(controller, CruiseController)
    values = controller(speed=20.0, target_speed=30.0, has_ahead=True, ahead_speed=22.0).outputs()
    assert values["demand"] == pytest.approx(0.33)
    alone = controller(speed=20.0, target_speed=30.0, ahead_speed=22.0).outputs()
    assert alone["demand"] == pytest.approx(0.30)
    resistance = 0.01176 + 0.00077616 * 20.0 + 0.00016 * 400.0
    assert alone["force"] == pytest.approx(400e3 * (resistance + 0.30))
    limited = controller(speed=0.0, target_speed=85.0).outputs()
    assert (limited["demand"], limited["bottom_demand"]) == pytest.approx((0.8, 2.55))


def test_it_gives_what_the_metrics_of_the_published_scenarios_look_at(tmp_path: Path) -> None:
    write_skeleton(tmp_path / "mine.py")
    outputs = resolve(f"{tmp_path / 'mine.py'}:Mine")().outputs()
    assert set(outputs) == {"demand", "force", "range_violated", "bottom_demand"}


def test_it_tells_how_to_run_it_under_its_own_name(tmp_path: Path) -> None:
    write_skeleton(tmp_path / "fast_train2.py")
    text = (tmp_path / "fast_train2.py").read_text()
    for command in ("orchestrate run comfort_cruise --swap cruise=", "orchestrate describe ", "orchestrate build "):
        assert f"{command}fast_train2.py:FastTrain2" in text


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("controller.txt", "give a name that ends in .py"),
        ("1st.py", "letters, digits and _ only"),
        ("my-controller.py", "letters, digits and _ only"),
        ("régulateur.py", "letters, digits and _ only"),
        ("class.py", "letters, digits and _ only"),
        ("_.py", "cannot name a class of yours"),
        ("parameter.py", "'Parameter' cannot name a class of yours"),
        ("comfort_cruise.py", "'ComfortCruise' cannot name a class of yours"),
        ("none.py", "'None' cannot name a class of yours"),
        ("nowhere/mine.py", "cannot be written: No such file or directory"),
    ],
)
def test_a_name_that_would_not_work_is_refused_and_nothing_is_written(name: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=message):
        write_skeleton(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_exists_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text("precious")
    with pytest.raises(ScenarioError, match="exists already"):
        write_skeleton(tmp_path / "mine.py")
    assert (tmp_path / "mine.py").read_text() == "precious"
