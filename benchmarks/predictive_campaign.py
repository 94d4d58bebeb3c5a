"""Predictive and constant time headway control in the radio campaign, the papers' laws beside them.

    python benchmarks/predictive_campaign.py --runs 500 --seed 2     # the table of docs/predictive.md

The draws are those of `radio_campaign.py`: a train ahead that stops without a word, trains at virtual-coupling
distances, a radio that is late, loses messages and is out when it matters. Every draw is simulated under each law, with
its fallback, without and with the guard, and with the same radio luck. The train that stops tells no plan; the trains
behind it tell theirs by the same messages, where the law has one. The exit code is 1 when a margin goes negative under
`DistributedMpc` with its guard.
"""

import argparse
import itertools
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
import radio_campaign

VARIANTS = radio_campaign.SAFE
LAWS = ("DistributedMpc", "TimeHeadwayCruise", *radio_campaign.LAWS)


def outcomes(
    seed: int, numbers: Iterable[int], laws: Sequence[str], variants: Sequence[str] = VARIANTS
) -> Iterator[radio_campaign.Outcome]:
    """Every draw under every law."""
    for number in numbers:
        for law in laws:
            for variant in variants:
                yield radio_campaign.simulate(replace(radio_campaign.draw(seed, number), law=law), variant)


def table(found: Sequence[radio_campaign.Outcome], laws: Sequence[str]) -> Iterator[str]:
    """Lines of a Markdown table, one for each law."""
    yield "| law | variant | runs | margin < 0 | min m | 1 % m | median m | trains met | worst run |"
    yield "| --- | --- | --- | --- | --- | --- | --- | --- | --- |"
    for law, variant in itertools.product(laws, VARIANTS):
        mine = [x for x in found if (x.drawn.law, x.variant) == (law, variant)]
        margins = np.array([x.margin for x in mine])
        low, median = np.percentile(margins, [1, 50])
        worst = min(mine, key=lambda x: x.margin)
        met = sum(x.gap <= radio_campaign.STANDSTILL - 20.0 for x in mine)
        yield (
            f"| {law} | {variant} | {len(mine)} | {(margins < 0.0).sum()} | {margins.min():.1f} | {low:.1f} "
            f"| {median:.1f} | {met} | {worst.drawn.number}, train {worst.train} |"
        )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=500, help="how many draws")
    parser.add_argument("--seed", type=int, default=2, help="of the campaign")
    parser.add_argument("--law", choices=LAWS, action="append", help="this law alone; may be given again")
    options = parser.parse_args()
    laws = options.law or LAWS
    found = []
    for outcome in outcomes(options.seed, range(options.runs), laws):
        found.append(outcome)
        print(
            f"\r{len(found)} of {options.runs * len(laws) * len(VARIANTS)} simulations",
            end="",
            file=sys.stderr,
            flush=True,
        )
    print(file=sys.stderr)
    print("\n".join(table(found, laws)))
    shipped = ("DistributedMpc", "fallback and guard")
    return int(any(x.margin < 0.0 for x in found if (x.drawn.law, x.variant) == shipped))


if __name__ == "__main__":
    sys.exit(main())
