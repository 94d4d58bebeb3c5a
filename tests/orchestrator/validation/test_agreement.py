"""What became of a row of outputs is shown as far as a reader can take it in."""

import pytest
from railcosim.orchestrator.errors import FmuError
from railcosim.orchestrator.validation.agreement import compare


def test_a_short_row_is_shown_as_a_whole():
    with pytest.raises(FmuError, match=r"^other outputs here: at step 2, \[1.0, 2.0\] became \[1.0, 3.0\]$"):
        compare([[1.0, 2.0], [1.0, 2.0]], [[1.0, 2.0], [1.0, 3.0]], "here")


@pytest.mark.parametrize(("changed", "end"), [(2, "number 2 from 1.0 to 2.0"), (100_000, ", ...")])
def test_of_a_long_row_only_a_few_that_changed(changed, end):
    before, after = [1.0] * 100_000, [2.0] * changed + [1.0] * (100_000 - changed)
    with pytest.raises(FmuError) as caught:
        compare([before], [after], "here")
    told = str(caught.value)
    assert told.startswith(f"other outputs here: at step 1, {changed} of 100000 changed: number 1 from 1.0 to 2.0, ")
    assert told.endswith(end)
    assert len(told) < 400
