"""Why a step of a run runs again: what changed since it was performed."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from rockframe.runs.plan import INPUTS, Plan, Step

#: Reason of a step that was never performed in the folder.
NOT_YET: Final = "not run yet"
#: Reason of a step of which only the manifest tells that it was performed.
_UNKNOWN: Final = "an input, an option or the code changed"
#: Longest value of an option that is shown.
_SHORT: Final = 40
#: Stands for an option that is not stated.
_NONE: Final = object()


def changes(before: Mapping[str, Any], plan: Plan, step: Step) -> str:
    """Return why the outputs of a step are outdated, in words.

    Parameters
    ----------
    before : mapping
        Everything that the outputs depended on (`Step.origin`); empty if it is unknown.
    plan : Plan
        The plan of the run.
    step : Step
        The step.

    Examples
    --------
    >>> step = Step("pulse", "pulse", (), ("pulses.nc",), {"surrogates": 20})
    >>> before = step.origin({}, {}) | {"options": {"surrogates": 0}}
    >>> plan = Plan("mine", {}, (), (step,), {"pulse": step.origin({}, {})}, {}, "")
    >>> changes(before, plan, step)
    'option surrogates changed from 0 to 20'
    """
    now = plan.origins[step.name]
    if not before:
        return _UNKNOWN
    if before["code"] != now["code"]:
        return "code changed"  # on which all steps depend
    packages = list(_changed_packages(before["packages"], now["packages"]))
    if packages:
        return _few(packages)
    options = list(_changed_options(before["options"], now["options"]))
    reasons = [_few(options)] if options else []
    if before["batch"] != now["batch"]:
        reasons.append("division into batches changed")
    outside = list(_changed_files(before["outside"], now["outside"]))
    reasons += [_few(outside)] if outside else []
    reasons += _changed_inputs(before["inputs"], now["inputs"], plan, listed=bool(outside))
    return "; ".join(reasons) or _UNKNOWN


def _few(reasons: Sequence[str]) -> str:
    """Return the first of many reasons of a kind, and the number of others."""
    return reasons[0] + (f" and {len(reasons) - 1} more" if len(reasons) > 1 else "")


def _changed_packages(before: Mapping[str, str], now: Mapping[str, str]) -> Iterator[str]:
    for name, version in now.items():
        if before.get(name) != version:
            yield f"{name} changed from {before.get(name, 'none')} to {version}"


def _changed_options(before: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    """Yield each option that changed, with its values if they are short."""
    old, new = dict(_leaves(before)), dict(_leaves(now))
    for name in {**new, **old}:
        if old.get(name, _NONE) != new.get(name, _NONE):
            values = [
                json.dumps(options[name]) if name in options else "none" for options in (old, new)
            ]
            shown = max(map(len, values)) <= _SHORT
            yield f"option {name} changed" + (" from {} to {}".format(*values) if shown else "")


def _leaves(options: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """Yield options by their names; those of a table have its name before them."""
    for name, value in options.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{above}{name}.")
        else:
            yield above + name, value


def _changed_files(before: Mapping[str, str], now: Mapping[str, str]) -> Iterator[str]:
    for name in {**now, **before}:
        if name not in now:
            yield f"{name} removed"
        elif name not in before:
            yield f"{name} added"
        elif before[name] != now[name]:
            yield f"{name} changed"


def _changed_inputs(
    before: Mapping[str, str], now: Mapping[str, str], plan: Plan, *, listed: bool
) -> Iterator[str]:
    """Yield the changed files of the plan, and the steps whose outputs changed.

    `listed` states that the changed files in the list of inputs are named already.
    """
    changed = [name for name, key in now.items() if before.get(name) != key]
    yield from (f"{name} changed" for name in changed if name in plan.files and name != INPUTS)
    if INPUTS in changed and not listed:
        yield f"{INPUTS} changed"
    writers = [step.name for step in plan.steps if set(step.outputs).intersection(changed)]
    if writers:
        yield f"follows from {_few(writers)}"
