"""Which signals there are, for whoever asks for one that is not."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from ...names import SignalName
from ...problems import suggestion

_SHOWN = 6


def missing_signal(name: object, signals: Collection[str], parameters: Collection[str]) -> str:
    """What to tell of a signal that was not recorded: those of the group or array it names, or the nearest one.

    Args:
        name: that was asked for.
        signals: that were recorded.
        parameters: by full name.
    """
    if not isinstance(name, str):
        return f"a signal is asked for by its name, not by {name!r}"
    none = f"there is no signal {name!r}"
    if name in parameters:
        return f"{none}: that is a parameter, whose value stands in parameters"
    asked = SignalName.parse(name)
    covered = [signal for signal in signals if asked.covers(SignalName.parse(signal))]
    if covered:
        what = "one of each instance" if asked.group == asked.instance != SignalName.parse(covered[0]).instance else ""
        return f"{none}; {what or 'its elements are'}: {_listed(covered)}"
    own = [each for each in map(SignalName.parse, signals) if asked.instance in (each.instance, each.group)]
    if own:
        near = suggestion(asked.variable, dict.fromkeys(each.variable for each in own))
        if near:
            whole = near.replace("'", f"'{asked.instance}.", 1)
            return f"{none}; {whole}"
        return f"{none}; {asked.instance} has {_listed([*map(str, own)])}"
    near = suggestion(name, signals)
    return f"{none}; {near or f'there are {_listed(signals)}'}"


def shortened(signals: Iterable[str]) -> str:
    """Signals by family, ``train[i].speed``, and only the first few."""
    return _listed(list(dict.fromkeys(str(SignalName.parse(signal).family) for signal in signals)))


def _listed(names: Collection[str]) -> str:
    shown = list(names)[:_SHOWN]
    return ", ".join(shown) + (f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else "")
