"""Information graphs against their known Laplacians and eigenvalues."""

import numpy as np
import pytest
from railcosim.orchestrator.cli.skeleton import write_skeleton
from railcosim.orchestrator.fmi.archive import Workspace
from railcosim.orchestrator.run.checking import check
from railcosim.orchestrator.scenario.loading import load
from railcosim.orchestrator.wiring.topology import describe_topology, topologies


def found(name, **changes):
    with Workspace() as workspace:
        checked = check(load(name, **changes), workspace, "plain")
    interfaces = {instance: model.interface for instance, model in checked.models.items()}
    return topologies(interfaces, checked.wiring), list(describe_topology(interfaces, checked.wiring))


def test_neighbours_on_both_sides_are_a_path():
    """Eigenvalues of the path of n nodes: 2 - 2 cos(k pi / n)."""
    (graph,), lines = found("braking_wave")
    assert graph.name == "neighbours on both sides"
    assert graph.vehicles == tuple(f"train[{i}]" for i in range(1, 11))
    path = 2.0 * np.eye(10) - np.eye(10, k=1) - np.eye(10, k=-1)
    path[0, 0] = path[-1, -1] = 1.0
    assert (graph.laplacian == path).all()
    assert graph.eigenvalues == pytest.approx(2.0 - 2.0 * np.cos(np.arange(10) * np.pi / 10), abs=1e-9)
    assert graph.reaches_all
    assert lines[0] == "information: neighbours on both sides, train[1] to train[10]"
    assert lines[1].startswith("  Laplacian [ 1 -1  0  0")
    assert lines[-1].startswith("  eigenvalues 0, 0.09789, ")


def test_predecessor_only_has_every_eigenvalue_one():
    (graph,), _ = found("braking_wave", preset="predecessor")
    assert graph.name == "predecessor only"
    assert (graph.laplacian == np.diag([0.0, *[1.0] * 9]) - np.diag([1.0] * 9, -1)).all()
    assert graph.eigenvalues == pytest.approx([0.0, *[1.0] * 9], abs=1e-9)


def test_predecessor_and_leader():
    (graph,), _ = found("braking_wave", preset="predecessor-leader")
    assert graph.name == "predecessor and leader"
    assert np.diag(graph.laplacian).tolist() == [0.0, 1.0, *[2.0] * 8]
    assert (graph.laplacian[2:, 0] <= -1.0).all()
    assert graph.eigenvalues == pytest.approx([0.0, 1.0, *[2.0] * 8], abs=1e-6)


def test_a_law_that_looks_ahead_only_hears_nobody_behind_whatever_is_connected(tmp_path):
    write_skeleton(tmp_path / "my_law.py")
    (graph,), _ = found("comfort_cruise", swaps=[f"cruise={tmp_path / 'my_law.py'}:MyLaw"])
    assert graph.name == "predecessor only"
    assert (graph.laplacian == np.diag([0.0, 1.0, 1.0, 1.0]) - np.diag([1.0] * 3, -1)).all()


def test_a_radio_in_between_is_looked_through():
    (graph,), _ = found("degraded_radio")
    assert graph.name == "neighbours on both sides"
    assert len(graph.vehicles) == 5


def test_several_platoons_are_told_apart():
    graphs, lines = found("cruise_comparison")
    assert [graph.vehicles[0] for graph in graphs] == [f"train[{i}]" for i in (1, 6, 11, 16, 21)]
    assert [line.partition(", train")[0] + line[line.rindex(" (") :] for line in lines if "alike" in line] == [
        "information: neighbours on both sides (3 platoons alike)",
        "information: predecessor only (2 platoons alike)",
    ]


def test_a_train_that_hears_nobody_breaks_the_chain():
    settings = ["cruise.has_behind=false", "cruise.has_ahead=i > 1"]
    (whole,), _ = found("braking_wave", settings=settings)
    assert whole.reaches_all
    (graph,), lines = found("comfort_cruise", settings=["cruise.has_ahead=i == 2", "cruise.has_behind=i == 2"])
    assert graph.vehicles == ("train[1]", "train[2]", "train[3]")
    assert graph.name == "other"
    assert not graph.reaches_all
    assert "cannot agree" in lines[-1]


def test_a_system_without_a_platoon_has_none():
    assert found("comfort_cruise", settings=["cruise.has_ahead=false", "cruise.has_behind=false"]) == ([], [])
