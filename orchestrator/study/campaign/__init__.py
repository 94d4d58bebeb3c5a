"""Many runs on many workers, and the table they leave.

`running` runs a plan: `parcel` is what workers need, `pool` where they are (in this process, or on a `cluster`, where
`flight` sends chunks of the size that `pace` finds to the `worker`s), `dataset` what is on disk, of `columns`. `study`
reads that, and `replay` runs a row of it again.
"""

from .columns import Entry
from .dataset import Dataset, parts_of, rewrite
from .flight import Point
from .parcel import Parcel, named_in, packed
from .pool import Pool, pool_for
from .replay import Replayed, replay
from .running import need_packages, run_study
from .study import Study

__all__ = [
    "Dataset",
    "Entry",
    "Parcel",
    "Point",
    "Pool",
    "Replayed",
    "Study",
    "named_in",
    "need_packages",
    "packed",
    "parts_of",
    "pool_for",
    "replay",
    "rewrite",
    "run_study",
]
