"""Plans: whose values depend on nothing but the plan."""

import pickle
from itertools import product

import pytest
from railcosim.orchestrator.study.design import DESIGNS, Dimension, Plan

MIXED = tuple(
    map(Dimension.parse, ("a.x=normal(0, 1)", "a.y=loguniform(1, 9)", "b=A,B", "c.z=0:1:11", "d.n=integers(1, 6)"))
)


def test_a_grid_is_the_product_with_the_last_changing_first():
    plan = Plan(tuple(map(Dimension.parse, ("a.x=1,2", "b=A,B,C", "c.y=0:1:2"))), "grid", 12)
    assert plan.block(0, 12) == [{"a.x": x, "b": b, "c.y": y} for x, b, y in product((1, 2), "ABC", (0, 1))]
    assert plan.changes(7) == {"a.x": 2, "b": "A", "c.y": 1}


@pytest.mark.parametrize("design", DESIGNS[1:])
def test_values_do_not_depend_on_chunks(design, monkeypatch):
    plan = Plan(MIXED, design, 700, 5)
    whole = plan.block(0, 700)
    assert [plan.changes(k) for k in (0, 699, 3)] == [whole[0], whole[699], whole[3]]
    monkeypatch.setattr("railcosim.orchestrator.study.design.plan._BLOCK", 64)
    again = Plan(MIXED, design, 700, 5)
    assert [row for first in range(0, 700, 50) for row in again.block(first, first + 50)] == whole
    assert whole != Plan(MIXED, design, 700, 6).block(0, 700)
    assert {*whole[0]} == {"a.x", "a.y", "b", "c.z", "d.n", "simulation.seed"}


def test_a_random_run_does_not_depend_on_how_many_there_are():
    assert Plan(MIXED, "random", 9, 5).block(0, 9) == Plan(MIXED, "random", 10_000, 5).block(0, 9)


@pytest.mark.parametrize("design", DESIGNS[1:])
def test_a_plan_is_read_as_it_was_written(design):
    plan = Plan((*MIXED, Dimension.parse("e.v=[1, 2],[3, 0.1]"), Dimension.parse("f.t=true,false")), design, 72, 5)
    again = Plan.from_json(plan.to_json())
    assert again == plan
    assert again.block(0, 72) == plan.block(0, 72) == pickle.loads(pickle.dumps(plan)).block(0, 72)


def test_a_run_has_its_own_noise_unless_the_seed_is_varied_or_all_is_a_grid():
    one = (Dimension.parse("a.x=1:2"),)
    seeds = [row["simulation.seed"] for row in Plan(one, "random", 50).block(0, 50)]
    assert len(set(seeds)) == 50
    assert Plan((), "random", 2, 0).changes(1) == {"simulation.seed": seeds[1]}
    seeded = Plan((*one, Dimension.parse("simulation.seed=3,4")), "sobol", 50)
    assert {row["simulation.seed"] for row in seeded.block(0, 50)} == {3, 4}
    assert Plan((Dimension.parse("a.x=1,2"),), "grid", 2).changes(0) == {"a.x": 1}


def test_saltellis_noise_is_that_of_a_but_for_b():
    rows = Plan(MIXED[:3], "saltelli", 5 * 40, 2).block(0, 200)
    blocks = [[row["simulation.seed"] for row in rows[k : k + 5]] for k in range(0, 200, 5)]
    assert all(len(set(block[:4])) == 1 and block[4] != block[0] for block in blocks)
    assert len({seed for block in blocks for seed in block}) == 80
    assert Plan(MIXED[:3], "saltelli", 200, 2).block(63, 68) == rows[63:68]


@pytest.mark.parametrize(("first", "last"), [(-1, 0), (0, 13), (5, 4)])
def test_runs_that_are_not_there(first, last):
    with pytest.raises(IndexError, match="of a plan of 12"):
        Plan((), "random", 12).block(first, last)


def test_what_it_changes_is_not_shared():
    plan = Plan(MIXED, "random", 3)
    plan.changes(0)["a.x"] = None
    assert plan.changes(0)["a.x"] is not None
