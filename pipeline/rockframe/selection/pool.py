"""Motions of which some are selected: those that the constraints allow, and why others are not."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.options.ingest import SelectOptions
from rockframe.selection.choice import Candidates, Groups, choose, scaled_by, scaled_to_fit
from rockframe.selection.target import TargetSpectrum

Float = NDArray[np.float64]


def periods_of(target: TargetSpectrum, options: SelectOptions) -> Float:
    """Return the periods at which a selection needs spectra [s]: those of the target, then that of
    the scaling if there is one.

    Examples
    --------
    >>> from pathlib import Path
    >>> target = TargetSpectrum(np.array([0.5, 1.0]), np.zeros(2), None, "")
    >>> periods_of(target, SelectOptions(target=Path("t.csv"), scale_period_s=0.7)).tolist()
    [0.5, 1.0, 0.7]
    """
    at = _scaled_at(options)
    return np.append(target.period, [] if at is None else [at])


def _scaled_at(options: SelectOptions) -> float | None:
    return options.conditioning_period_s or options.scale_period_s


class Pool:
    """Motions from which some are selected.

    Parameters
    ----------
    noun : str
        Plural of what is selected, for messages.
    reasons : mapping of str to str
        Reason why each motion is no candidate, by its identifier; "" for candidates. Each reason
        begins with the constraint.
    target : TargetSpectrum
        The target.
    options : SelectOptions
        Number of motions, scales and limits.

    Examples
    --------
    >>> from pathlib import Path
    >>> target = TargetSpectrum(np.array([0.5, 1.0]), np.zeros(2), None, "")
    >>> options = SelectOptions(target=Path("t.csv"), motions=1)
    >>> pool = Pool("records", {"a": "", "b": "", "c": "magnitude 5"}, target, options)
    >>> spectra = np.log([[2.0, 2.0], [2.0, 1.0]])
    >>> pool.chosen(spectra, ["A", "B"], ["", ""])[0]
    {'a': 0.5}
    """

    def __init__(
        self,
        noun: str,
        reasons: Mapping[str, str],
        target: TargetSpectrum,
        options: SelectOptions,
    ) -> None:
        self.noun, self._target, self._options = noun, target, options
        self.number = len(reasons)
        self.left_out = {name: reason for name, reason in reasons.items() if reason}
        self.names = [name for name in reasons if name not in self.left_out]

    def chosen(
        self,
        log_sa: Float,
        stations: Sequence[Hashable],
        events: Sequence[Hashable],
        pgv: Float | None = None,
    ) -> tuple[dict[str, float], Float]:
        """Return the factors of the selected motions by name, and their scaled spectra.

        Afterwards, `names` and `left_out` also consider the bounds of the factors.

        Parameters
        ----------
        log_sa : array, shape (names, periods)
            Natural logarithm of the unscaled spectra in m s-2, at `periods_of`.
        stations, events : sequence
            Station and event of each candidate; unknown ones ("") are groups of their own.
        pgv : array, shape (names,), optional
            Peak ground velocities [m s-1], for `scale_pgv_m_s`.

        Raises
        ------
        ParameterError
            If not enough motions can be selected.
        """
        options, names = self._options, self.names
        candidates = self._scaled(log_sa, pgv)
        groups = [_groups(stations, options.most_per_station)]
        if options.most_per_event is not None:
            groups.append(_groups(events, options.most_per_event))
        choice = choose(candidates, self._target, options.motions, groups, options.seed)
        within = {names[motion] for motion in candidates.motion}
        low, high = options.scale_bounds
        out = f"scale_bounds exceeded. Must be from {low:g} to {high:g}"
        self.left_out |= dict.fromkeys((name for name in names if name not in within), out)
        self.names = [name for name in names if name in within]
        if choice.size < options.motions:
            raise ParameterError(self._why_few(choice.size))
        choice = choice[np.argsort(candidates.motion[choice])]
        factors = {names[candidates.motion[k]]: float(candidates.factor[k]) for k in choice}
        return factors, candidates.log_sa[choice]

    def _scaled(self, log_sa: Float, pgv: Float | None) -> Candidates:
        """Return the candidates with the factors that the options allow."""
        target, options = self._target, self._options
        compared = log_sa[:, : target.period.size]
        at = _scaled_at(options)
        if at is not None:
            factor = np.exp(target.log_sa_at(at) - log_sa[:, -1])
            return scaled_by(compared, factor, options.scale_bounds)
        if options.scale_pgv_m_s is not None and pgv is not None:
            return scaled_by(compared, options.scale_pgv_m_s / pgv, options.scale_bounds)
        return scaled_to_fit(compared, target, options.scale_bounds)

    def _why_few(self, reached: int) -> str:
        """Return the message that not enough motions can be selected, and why."""
        options = self._options
        removed = Counter(reason.split(" ")[0] for reason in self.left_out.values())
        limits = "most_per_station" + (" or most_per_event" if options.most_per_event else "")
        removed[limits] = len(self.names) - reached
        counted = ", ".join(f"{count} by {name}" for name, count in removed.most_common() if count)
        wanted = f"{options.motions} motions wanted, but only {reached} can be selected of"
        out = f" Filtered out: {counted}." if counted else ""
        advice = "Allow more, add records, or state fewer motions."
        return f"{wanted} {self.number} {self.noun}.{out} {advice}"


def _groups(keys: Sequence[Hashable], most: int) -> Groups:
    """Return the limit of each station or event; an unknown one ("") is a group of its own."""
    own = [(key,) if key != "" else row for row, key in enumerate(keys)]
    numbers = {key: number for number, key in enumerate(dict.fromkeys(own))}
    return Groups(np.array([numbers[key] for key in own], dtype=np.int64), most)
