"""Claims about pulses and about the records of Table 1."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rockframe.paper.claim import Claim, Finding, agrees_to_last_digit, judged, number_claim
from rockframe.paper.table1 import (
    Comparison,
    bridge_extremes,
    bridge_rows,
    compare,
    paper_records,
)
from rockframe.results.tables.rows import Row
from rockframe.wavelets.family import RICKERS
from rockframe.wavelets.pulse import Pulse
from rockframe.wavelets.ricker import BETA

Float = NDArray[np.float64]

#: Period of the paper's Pacoima Dam pulse, at which eq (45) is evaluated [s].
_PERIOD: Final = 1.27
_TIME: Final = np.linspace(-3.0, 3.0, 60_001) * _PERIOD


def pulse_claims() -> list[Claim]:
    """Return the claims about the two pulses.

    Examples
    --------
    >>> [claim.finding.value for claim in pulse_claims()]
    ['agrees', 'misprint', 'agrees', 'agrees']
    """
    symmetric = _symmetric_difference()
    return [
        Claim(
            name="eq-44",
            where="eq (44)",
            says="the symmetric Ricker wavelet",
            printed="a_p (1 - 2π²t²/T_p²) exp(-π²t²/T_p²)",
            ours=f"largest difference {symmetric:.1e} a_p",
            finding=judged(symmetric < 1e-14),
        ),
        _antisymmetric_claim(),
        number_claim("beta", "eq (45)", "β, which makes the maximum a_p", "1.3801", BETA),
        _spectrum_claim(),
    ]


def _symmetric_difference() -> float:
    y = (math.pi * _TIME / _PERIOD) ** 2
    ours = Pulse(wavelet="symmetric_ricker", a_p=1.0, T_p=_PERIOD).acceleration(_TIME)
    return float(np.abs((1.0 - 2.0 * y) * np.exp(-y) - ours).max())


def _antisymmetric_claim() -> Claim:
    """Check eq (45), which is printed with t in place of 2 pi t / (sqrt(3) T_p)."""
    x = math.tau * _TIME / (math.sqrt(3.0) * _PERIOD)
    printed = np.abs((x**2 - 3.0) * _TIME * np.exp(-0.5 * x**2) / BETA).max()
    meant = np.abs((x**2 - 3.0) * x * np.exp(-0.5 * x**2) / BETA).max()
    ours = np.abs(Pulse(wavelet="antisymmetric_ricker", a_p=1.0, T_p=_PERIOD).acceleration(_TIME))
    sound = abs(ours.max() - 1.0) < 1e-6 and abs(meant - 1.0) < 1e-6
    return Claim(
        name="eq-45",
        where="eq (45)",
        says="the antisymmetric Ricker wavelet, of maximum a_p",
        printed=f"maximum {printed:.4f} s a_p for T_p = {_PERIOD:g} s",
        ours=f"maximum {ours.max():.4f} a_p, with the factor 2π/(√3 T_p)",
        finding=Finding.MISPRINT if sound and abs(printed - 1.0) > 0.01 else judged(sound),
        remark="as printed it has the unit of time",
    )


def _spectrum_claim() -> Claim:
    """Find the peak of the Fourier spectrum on a grid of frequencies around 2 pi / T_p."""
    ratio = np.linspace(0.8, 1.2, 401)
    angle = np.outer(math.tau / _PERIOD * ratio, _TIME)
    found = []
    for name in RICKERS:
        samples = Pulse(wavelet=name, a_p=1.0, T_p=_PERIOD).acceleration(_TIME[::10])
        spectrum = np.abs(np.exp(-1j * angle[:, ::10]) @ samples)
        found.append(float(1.0 / ratio[int(np.argmax(spectrum))]))
    return Claim(
        name="spectrum",
        where="section 6",
        says="T_p is the period at which the Fourier spectrum is largest",
        printed="T_p",
        ours=f"{found[0]:.3f} T_p (symmetric), {found[1]:.3f} T_p (antisymmetric)",
        finding=judged(all(abs(period - 1.0) < 1.5e-3 for period in found)),
    )


_COMMAND: Final = "rockframe table1 --records FOLDER"
#: Symbol in Table 1 and unit of each quantity.
_PRINTED: Final = {
    "pga_g": ("PGA", "g"),
    "pgv_m_s": ("PGV", "m/s"),
    "a_p_g": ("a_p", "g"),
    "T_p_s": ("T_p", "s"),
}


def record_claims(rows: Sequence[Row], pulses: Iterable[Mapping[str, Any]] = ()) -> list[Claim]:
    """Return the claims about the paper's records among the rows.

    Parameters
    ----------
    rows : sequence of mapping
        As returned by `table_rows`.
    pulses : iterable of mapping, optional
        As returned by `pulse_rows` for these records; see `compare`.
    """
    comparisons = compare(rows, pulses)
    others = {comparison.record_id: comparison.remark for comparison in comparisons
              if comparison.remark}  # fmt: skip
    names: set[str] = set()
    claims = []
    for found in comparisons:
        name = f"{found.record_id}-{found.quantity}"
        if name in names:  # with another wavelet than the selected one
            name = f"{name}-{found.wavelet}"
        names.add(name)
        claims.append(_of_table(name, found, others.get(found.record_id, "")))
    own = bridge_rows(rows)
    return claims + (_of_bridge(own) if own else [])


def _of_table(name: str, comparison: Comparison, other: str) -> Claim:
    """Return the claim of one comparison; `other` is set if PGA or PGV is not the paper's."""
    label, unit = _PRINTED[comparison.quantity]
    printed = comparison.printed
    finding = agrees_to_last_digit(printed, comparison.ours)
    remark = f"{100.0 * comparison.relative_difference:+.1f} %"
    if comparison.wavelet:
        remark += f", {comparison.wavelet.replace('_', ' ')}; the paper names no wavelet"
    if other:
        finding, remark = Finding.OPEN, f"{remark}; {other}"
    return Claim(
        name=name,
        where="Table 1",
        says=f"{label} of {comparison.record}",
        printed=f"{printed} {unit}",
        ours=f"{comparison.ours:.3f} {unit}",
        finding=finding,
        remark=remark,
        command=_COMMAND,
    )


def _of_bridge(own: Sequence[Row]) -> list[Claim]:
    turned, drifts, lifted = bridge_extremes(own)
    of = f"{len(own)} of the paper's {len(paper_records())} records are here with its PGA and PGV"
    ratio, lift = turned["peak_rotation_ratio"], 100.0 * lifted["v_max_m"]
    return [
        Claim(
            name="bridge-rotation",
            where="section 8, Figure 11",
            says="θ/α of the bridge under all six records",
            printed="< 0.33",
            ours=f"at most {ratio:.3f} ({turned['record']})",
            finding=judged(ratio < 0.33),
            remark=of,
            command=_COMMAND,
        ),
        Claim(
            name="bridge-drift",
            where="section 8, Figure 11",
            says="its largest drifts",
            printed="20 to 50 cm",
            ours=f"{drifts[0]:.1f} to {drifts[-1]:.1f} cm",
            finding=judged(drifts[0] >= 20.0 and drifts[-1] <= 50.0),
            remark=of,
            command=_COMMAND,
        ),
        Claim(
            name="bridge-lift",
            where="section 8, Figure 11",
            says="its largest lift",
            printed="up to 5 cm",
            ours=f"up to {lift:.1f} cm ({lifted['record']})",
            finding=judged(lift <= 5.0),
            remark=of,
            command=_COMMAND,
        ),
    ]
