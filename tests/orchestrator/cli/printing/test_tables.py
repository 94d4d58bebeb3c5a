"""Tables on a terminal that has no room for them."""

from railcosim.orchestrator.cli.printing.tables import table


def made(title="Metrics"):
    found = table(title, ("metric", "value", "unit", ""), right=("value",), fold=("metric",))
    found.add_row("settling_time_of_the_last_train", "138.7123456789", "s", "fine")
    found.add_row("overshoot", "0", "", "")
    return found


def test_with_room_a_row_is_a_line(shown):
    lines = shown(lambda out: out.print(made()), width=80)
    assert lines[1:3] == ["Metrics", "metric                                    value  unit"]
    assert lines[4].split() == ["overshoot", "0"]


def test_without_it_no_number_is_cut(shown):
    assert shown(lambda out: out.print(made()), width=30) == [
        "",
        "Metrics",
        "settling_time_of_the_last_trai",
        "n",
        "  value: 138.7123456789",
        "  unit: s",
        "  fine",
        "overshoot",
        "  value: 0",
    ]
    assert shown(lambda out: out.print(made("")), width=30)[0] == "settling_time_of_the_last_trai"
