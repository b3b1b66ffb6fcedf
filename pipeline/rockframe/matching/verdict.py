"""Verdict of the comparison of a pulse with noise, in a module that searches nothing."""

from __future__ import annotations

from enum import IntEnum


class PulseVerdict(IntEnum):
    """Result of the comparison with surrogates: the values of the variable `pulse_verdict`."""

    UNTESTED = 0
    PULSE = 1
    NOISE = 2
    AT_BOUND = 3


def pulse_words(verdict: PulseVerdict, p_value: float) -> str:
    """Return the result of the comparison with noise in words.

    Parameters
    ----------
    verdict : PulseVerdict
        Result of the comparison.
    p_value : float
        Share of surrogates that match at least as well [1].

    Examples
    --------
    >>> pulse_words(PulseVerdict.NOISE, 0.32)
    'best match, could be noise (p = 0.32)'
    """
    return {
        PulseVerdict.UNTESTED: "best match, not tested against noise",
        PulseVerdict.PULSE: f"pulse, unlikely to be noise (p = {p_value:.2f})",
        PulseVerdict.NOISE: f"best match, could be noise (p = {p_value:.2f})",
        PulseVerdict.AT_BOUND: "best match, at the end of the range of periods",
    }[verdict]
