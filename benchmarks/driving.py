"""Optimal driving on the lines of the TTOBench library, and how near to it controllers drive: a row each, as Markdown.

``RAILCOSIM_TTOBENCH=folder python benchmarks/driving.py [LINE...]``. Each line is driven from its first to its second
stop: in the least time, in a tenth more with the least energy, and by CAILC and PID along the profile of least energy
that leaves them a reserve of forces and powers.
"""

import json
import os
import sys
import tempfile
from pathlib import Path

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
SUPPLEMENT, RESERVE = 1.1, 0.05


def drive(folder: Path, line: str, train: str) -> str:
    """A row of the table."""
    track, stock = LIBRARY / "tracks" / f"{line}.json", LIBRARY / "trains" / f"{train}.json"
    stop = json.loads(track.read_text())["stops"]["values"][1]
    case = folder / f"{line}.toml"
    case.write_text(f"[drive]\nline = {str(track)!r}\ntrain = {str(stock)!r}\nend = {stop}\ntolerance = 1e-4\n")
    quick = optimise(load_case(case, changes={"minimize": "time"})).solution
    time = SUPPLEMENT * quick.time
    best = optimise(load_case(case, changes={"time": time})).solution
    spared = optimise(load_case(case, [f"reserve={RESERVE}"], {"time": time}))
    profile = write_profile(folder / line, spared.solution)
    data = spared.case.train
    inertia = data.mass * (1.0 + data.rotating_mass)
    lead = 0.5 / (spared.solution.accelerations[0, 0] or 1.0)
    builds = [f"{name}.line={track}" for name in ("timetable", "train")]
    builds += [f"{name}.train={stock}" for name in ("timetable", "train", "drive")]
    settings = [
        f"train.position={-lead}",
        f"train.start_offset={-lead}",
        f"ato[1].mass={inertia}",
        f"ato[1].tape_duration={round(time) + 20.0}",
        f"ato[1].beta={2.0 * inertia}",
        f"ato[2].proportional_gain={4.8 * inertia}",
        f"ato[2].integral_gain={4.8 * inertia}",
    ]
    told = []
    try:
        system = load(
            "optimal_driving",
            settings=settings,
            builds=[*builds, f"timetable.profile={profile}"],
            stop_time=round(time) + 17.0,
        )
        result = run(system, figures=False)
        for k in (1, 2):
            used = result[f"drive[{k}].drawn_energy"][-1] - result[f"drive[{k}].recovered_energy"][-1]
            off = result[f"ato[{k}].position_error"][-1]
            told += [f"{100.0 * (used / best.energy - 1.0):+.2f} %", f"{off:+.2f} m"]
    except RailcosimError as error:
        told = [str(error).splitlines()[0]]
    way = f"{line}, {stop / 1e3:.1f} km"
    row = [way, train, f"{quick.time:.1f}", f"{quick.energy / 3.6e6:.2f}", f"{best.energy / 3.6e6:.2f}", *told]
    return f"| {' | '.join(row)} |"


def main() -> None:
    """The table."""
    lines = sys.argv[1:] or sorted(path.stem for path in (LIBRARY / "tracks").glob("*.json"))
    print("| line | train | least time, s | its energy, kWh | least energy, kWh | CAILC | stops | PID | stops |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as folder:
        for line in lines:
            print(drive(Path(folder), line, TRAINS.get(line, VIRM)), flush=True)


if __name__ == "__main__":
    main()
