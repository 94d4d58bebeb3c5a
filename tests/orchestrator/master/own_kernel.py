"""A plugin of pytest's that puts another build of the compiled step loop in the place of the installed one.

The environment variable KERNEL names it.
"""

import importlib.util
import os
import sys

_SPEC = importlib.util.spec_from_file_location("railcosim.orchestrator.master.kernel", os.environ["KERNEL"])
_MODULE = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(_MODULE)
sys.modules["railcosim.orchestrator.master.kernel"] = _MODULE


def pytest_sessionfinish():
    from railcosim.orchestrator.master import compiled

    assert compiled.kernel is _MODULE
