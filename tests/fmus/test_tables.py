"""The generated tables: what the runtime is told about a model, read back by a C compiler's eyes where it matters."""

import re
import subprocess
from pathlib import Path

import pytest
from railcosim.components import Component, ComponentError, Input, Output, Parameter, PointMassTrain
from railcosim.fmus.native.tables import model_header
from railcosim.fmus.native.trace import trace
from railcosim.fmus.references import resolve

MIXED = f"{Path(__file__).parent / 'native_samples.py'}:Mixed"


def header(component):
    return model_header(component, trace(component, type(component).__name__), "{guid}")


def constants(text):
    return {key: int(value) for key, value in re.findall(r"#define ([A-Z_]+) (\d+)\n", text)}


def table(text, name):
    return re.search(rf"{name}\[\] = {{\n(.*?)}};", text, re.DOTALL)[1].splitlines()


def test_the_numbers_of_things():
    found = constants(header(resolve(MIXED)()))
    expected = {"N_OUTPUTS": 5, "N_STATES": 3, "N_MEMORY": 5, "N_TAPE": 2, "N_NOISES": 2, "N_INITIAL": 3, "N_TEXTS": 3}
    assert {key: found[key] for key in expected} == expected
    assert found["N_VALUES"] == found["N_VARIABLES"] + 2 + 3  # the cells of the tape and of the noise
    assert (found["N_REINITIALISED"], found["IS_SAMPLED"], found["HAS_HELD"]) == (1, 1, 1)
    train = constants(header(PointMassTrain()))
    assert (train["N_STATES"], train["IS_SAMPLED"], train["HAS_HELD"], train["N_TAPE"]) == (2, 0, 0, 0)


def test_variables_say_type_role_start_and_bounds():
    rows = {re.search(r'"(.*?)"', row)[1]: row.strip() for row in table(header(resolve(MIXED)()), "model_variables")}
    assert rows["gain"] == '{"gain", TYPE_REAL, ROLE_TUNABLE, 0.5, 0.0, 2.0, -1, -1, 1},'
    assert rows["teeth"] == '{"teeth", TYPE_INTEGER, ROLE_FIXED, 3.0, 1.0, 9.0, -1, -1, 1},'
    assert rows["door"] == '{"door", TYPE_BOOLEAN, ROLE_INPUT, 0.0, -INFINITY, INFINITY, -1, -1, 1},'
    assert rows["remark"] == '{"remark", TYPE_STRING, ROLE_INPUT, 0.0, -INFINITY, INFINITY, 2, -1, 1},'
    assert rows["y[2]"] == '{"y[2]", TYPE_REAL, ROLE_OUTPUT, 0.0, -INFINITY, INFINITY, -1, -1, 1},'
    assert all("ROLE_KEPT" in rows[name] for name in ("x[1]", "v", "m[2]", "n"))
    assert rows["x_start[2]"] == '{"x_start[2]", TYPE_REAL, ROLE_FIXED, 1.0, -INFINITY, INFINITY, -1, -1, 1},'


def test_what_starts_from_a_parameter_is_told_with_it():
    text = header(resolve(MIXED)())
    names = [re.search(r'"(.*?)"', row)[1] for row in table(text, "model_variables")]
    started = [names[int(row.strip(" ,"))] for row in table(text, "model_started")]
    assert started == ["x[1]", "x[2]", "n", "odd", "last_trip"]
    first, count = constants(text)["FIRST_START"], constants(text)["N_STARTS"]
    assert names[first : first + count] == ["x_start[1]", "x_start[2]", "n_start", "odd_start", "last_trip_start"]


def test_real_inputs_are_numbered():
    text = header(resolve(MIXED)())
    rows = [row.strip(" {},").split(", ") for row in table(text, "model_variables")]
    numbers = {row[0].strip('"'): int(row[-2]) for row in rows if row[-2] != "-1"}
    assert numbers == {"u[1]": 0, "u[2]": 1, "trip_time": 2}
    references = [int(row.strip(" ,")) for row in table(text, "model_real_inputs")]
    assert [rows[reference][0].strip('"') for reference in references] == list(numbers)
    assert constants(text)["N_REAL_INPUTS"] == 3


def test_outputs_with_feed_through_are_held_as_whole_arrays():
    assert [row.strip(" ,") for row in table(header(resolve(MIXED)()), "model_held")] == [
        *("true", "true"),  # y
        *("false", "false"),  # z, tossed
        "true",  # total
    ]


def test_values_given_to_the_component_are_its_starts():
    text = header(PointMassTrain(speed=0.1, mass=2.0))
    assert '"speed_start", TYPE_REAL, ROLE_FIXED, 0.1,' in text
    assert '"mass", TYPE_REAL, ROLE_FIXED, 2.0,' in text


class Labels(Component):
    """Texts of every kind."""

    label = Parameter("1", "plain")
    words = Input("1", "", shape=(2,))
    y = Output("1")

    def outputs(self):
        return {"y": 1.0}


@pytest.mark.parametrize(
    "text", ["", "Köln", 'a "quoted" \\ one', "??/ trigraph", "line\nbreak\t", "7\x01" + "7", "%s #1#"]
)
def test_texts_survive_the_c_compiler(tmp_path, text):
    program = tmp_path / "show.c"
    program.write_text(
        "#include <stdio.h>\n"
        + re.search(r"static const char.*?};", header(Labels(label=text, words=["x", text])), re.DOTALL)[0]
        + '\nint main(void) { for (int k = 0; k < 3; k++) { printf("%s|", model_texts[k]); } return 0; }\n'
    )
    subprocess.run(["gcc", "-std=c11", "-Wall", "-Werror", program, "-o", tmp_path / "show"], check=True)
    shown = subprocess.run([tmp_path / "show"], capture_output=True, check=True).stdout.decode()
    assert shown == f"{text}|x|{text}|"


@pytest.mark.parametrize("text", ["ä" * 512, "a\0b"])
def test_texts_that_do_not_fit_are_refused(text):
    with pytest.raises(ComponentError, match=r"Labels\.label.*1023"):
        header(Labels(label=text))
