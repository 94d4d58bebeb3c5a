"""The schema of what `--json` prints is that of the code, and the page shows all of it."""

import json
from dataclasses import dataclass

import pytest
from railcosim.orchestrator.cli.documents import DOCUMENTS


def test_the_schema_beside_the_code_is_that_of_the_code(json_page):
    kept = json.loads(json_page.SCHEMA.read_text(encoding="utf-8"))
    assert kept == json_page.schema(), "python docs/json_page.py writes it anew"


def test_the_page_has_every_document_and_every_field(json_page):
    text = json_page.tables()
    for name, definition in json_page.schema()["$defs"].items():
        assert name == "Number" or f"{{ #{name.lower()} }}" in text
        assert all(f"| `{field}` |" in text for field in definition.get("properties", ()))
    assert all(f"| `{command}` |" in text for command in DOCUMENTS)


def test_two_parts_of_one_name_are_refused(json_page):
    @dataclass
    class Failure:
        why: str

    json_page.schema()
    with pytest.raises(TypeError, match="two documents have a part that is called Failure"):
        json_page._schema(Failure, {})
