"""Text as HTML: what came from outside is shown, not obeyed."""

from railcosim.orchestrator.markup import escaped, number, table


def test_text():
    assert escaped('<b a="1">') == "&lt;b a=&quot;1&quot;&gt;"
    assert [number(x) for x in (None, 1.23456789, 7, "<")] == ["–", "1.23457", "7", "&lt;"]


def test_a_table():
    made = table(["a<"], [["<b>1</b>"]], "of <i>", "kind")
    assert made == (
        '<table class="kind"><caption>of &lt;i&gt;</caption><thead><tr><th scope="col">a&lt;</th></tr></thead>'
        "<tbody><tr><td><b>1</b></td></tr></tbody></table>"
    )
