"""Optimal driving on the lines of the TTOBench library, and how near to it controllers drive: a row each, as Markdown.

``RAILCOSIM_TTOBENCH=folder python benchmarks/driving.py [LINE...]``. Each line is driven from its first to its second
stop: in the least time, in a tenth more with the least energy, and by CAILC and PID along the profile of least energy
under a limit of jerk that leaves them a reserve of forces and powers. Reserve and gains follow from the train's data by
the rules of docs/driving.md.
"""

import json
import os
import sys
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from railcosim.orchestrator import RailcosimError, load, run
from railcosim.orchestrator.driving import load_case, optimise, write_profile

LIBRARY = Path(os.environ["RAILCOSIM_TTOBENCH"])
VIRM, KISS = "NL_Intercity_VIRM6", "CH_Stadler_KISS_SBB"
TRAINS = {
    "CH_Fribourg_Bern": "CH_Stadler_FLIRT_TPF",
    "CH_StGallen_Wil": KISS,
    "CH_Stadelhofen_Altstetten": KISS,
    "CN_Songjiazhuang_Yizhuang": "CN_Beijing_Subway",
}
"""Of the lines that are not driven by the VIRM."""
SUPPLEMENT = 1.1
JERK = 0.5
"""m/s3, comfortable."""
STEP, LAG = 0.05, 0.2
"""s: of the controllers' samples, and of the drive."""
REST = 1.5 * STEP
"""s: what delays the force beside the drive's lag, half a sample of holding it and one of computing."""
LEVEL = 10.0
"""s: who has followed a change of the acceleration late is level again after it."""
RESERVE = 2.0 * REST / LEVEL
TOO_FAST = 0.01
"""m/s: at rest, and within a limit."""
TOO_MUCH = 0.01
"""Share of the energy for which the friction brake, too, is used."""


def settings(inertia: float, time: float, lead: float) -> list[str]:
    """What the scenario is given for a train of that inertia in kg, a running time in s, and a lead in m."""
    alpha = 0.25 / LAG
    beta = 1.5 * alpha * inertia
    gain, integral_time = 0.5 * inertia / REST, 4.0 * REST
    return [
        f"timetable.preview={round(LAG / STEP)}",
        f"train.position={-lead}",
        f"train.start_offset={-lead}",
        f"ato[1].mass={inertia}",
        f"ato[1].tape_duration={round(time) + 20.0}",
        f"ato[1].alpha={alpha}",
        f"ato[1].beta={beta}",
        f"ato[1].learning_gain=[{beta}, 0.01, 0.01]",
        f"ato[1].estimate_min=[{-0.25 * inertia}, 0.0, 0.0]",
        f"ato[1].estimate_max=[{0.25 * inertia}, 100.0, 60.0]",
        f"ato[2].proportional_gain={gain * (1.0 + LAG / integral_time)}",
        f"ato[2].integral_gain={gain / integral_time}",
        f"ato[2].derivative_gain={gain * LAG}",
    ]


def arrival(time: NDArray[np.float64], speed: NDArray[np.float64]) -> float:
    """When a train has come to rest for good, in s."""
    return float(time[np.flatnonzero(np.abs(speed) > TOO_FAST)[-1]])


def electric(folder: Path, stock: Path) -> Path:
    """The same train without a friction brake."""
    data = json.loads(stock.read_text())
    data["max pn braking force"]["value"] = 0.0
    path = folder / stock.name
    path.write_text(json.dumps(data))
    return path


def drive(folder: Path, line: str, train: str) -> str:
    """A row of the table."""
    track, stock = LIBRARY / "tracks" / f"{line}.json", LIBRARY / "trains" / f"{train}.json"
    stop = json.loads(track.read_text())["stops"]["values"][1]
    case = folder / f"{line}.toml"
    case.write_text(f"[drive]\nline = {str(track)!r}\ntrain = {str(stock)!r}\nend = {stop}\ntolerance = 1e-4\n")
    quick = optimise(load_case(case, changes={"minimize": "time"})).solution
    time = SUPPLEMENT * quick.time
    best = optimise(load_case(case, changes={"time": time})).solution
    data = load_case(case, changes={"time": time}).train
    inertia = data.mass * (1.0 + data.rotating_mass)
    asked = [f"reserve={RESERVE}", f"jerk={JERK}"]
    driven, text = electric(folder, stock), case.read_text()
    case.write_text(text.replace(str(stock), str(driven)))
    spared = optimise(load_case(case, asked, {"time": time})).solution
    if spared.energy - best.energy > TOO_MUCH * abs(best.energy):
        driven = stock
        case.write_text(text)
        spared = optimise(load_case(case, asked, {"time": time})).solution
    profile = write_profile(folder / line, spared)
    first, last = abs(spared.accelerations[0, 0]), abs(spared.accelerations[-1, -1])
    lead = 2.0 / (3.0 * first)  # from rest to 1 m/s, under an even rise of the acceleration
    builds = [f"{name}.line={track}" for name in ("timetable", "train")]
    builds += [f"{name}.train={driven}" for name in ("timetable", "train", "drive")]
    builds += [f"timetable.profile={profile}"]
    told = []
    try:
        system = load(
            "optimal_driving",
            settings=settings(inertia, time, lead),
            builds=builds,
            stop_time=round(time + 10.0 + 2.0 / first + 2.0 / last + 4.0),
        )
        result = run(system.changed(record=STEP), figures=False)
        due = arrival(result.time, result["timetable.reference_speed"])
        for k in (1, 2):
            speed = result[f"train[{k}].speed"]
            over = (speed - result["timetable.speed_limit"]).max()
            used = result[f"drive[{k}].drawn_energy"][-1] - result[f"drive[{k}].recovered_energy"][-1]
            off = result[f"ato[{k}].position_error"][-1]
            more = used - best.energy
            told += [
                f"{100.0 * more / abs(best.energy):+.2f} %, {more / 3.6e6:+.2f} kWh",
                f"{off:+.2f} m, {arrival(result.time, speed) - due:+.2f} s",
            ]
            told[-1] += f", {over:.2f} m/s too fast" if over > TOO_FAST else ""
    except RailcosimError as error:
        told = [str(error).splitlines()[0]]
    way = f"{line}, {stop / 1e3:.1f} km"
    row = [
        way,
        train,
        f"{quick.time:.1f}",
        f"{quick.energy / 3.6e6:.2f}",
        f"{best.energy / 3.6e6:.2f}",
        f"{100.0 * (spared.energy - best.energy) / abs(best.energy):+.2f} %",
        *told,
    ]
    return f"| {' | '.join(row)} |"


def main() -> None:
    """The table."""
    lines = sys.argv[1:] or sorted(path.stem for path in (LIBRARY / "tracks").glob("*.json"))
    print(
        "| line | train | least time, s | its energy, kWh | least energy, kWh | profile | CAILC | stops | PID | stops |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as folder:
        for line in lines:
            print(drive(Path(folder), line, TRAINS.get(line, VIRM)), flush=True)


if __name__ == "__main__":
    main()
