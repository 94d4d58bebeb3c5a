"""PyFMI's Master, where it is installed: there is no wheel on PyPI and its sdist does not build there, so CI has none.

Not run on the machine where this was written. With its initialization by blocks the Master begins with consistent
inputs; from then on it exchanges after every step: our `jacobi`.
"""

import pytest

pytestmark = pytest.mark.long


def simulate(scene, folder):
    """Positions and speeds of all trains."""
    import pyfmi

    models = {}
    for name, part in scene.parts.items():
        models[name] = pyfmi.load_fmu(str(part.path), log_file_name=str(folder / f"{name}.txt"))
        for variable, value in part.starts:
            typed = {"Real": float, "Integer": int, "Boolean": bool}[variable.type](value)
            models[name].set(variable.name, typed)
    connections = [
        (models[link.source.name], link.output.name, models[link.target.name], link.input.name) for link in scene.links
    ]
    master = pyfmi.Master(list(models.values()), connections)
    options = master.simulate_options()
    options["step_size"] = scene.step
    options["block_initialization"] = True
    options["result_handling"] = "memory"
    results = master.simulate(start_time=0.0, final_time=scene.stop_time, options=options)
    return {
        f"{name}.{signal}": results[models[name]][signal]
        for name in scene.parts
        if name.startswith("train")
        for signal in ("position", "speed")
    }


def test_the_scenario_is_our_jacobi(scene, need, tmp_path):
    need("pyfmi")
    assert scene.deviation("jacobi", simulate(scene, tmp_path)) <= 1e-9
