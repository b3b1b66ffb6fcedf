"""All claims that need no records, in the order of the paper."""

from __future__ import annotations

from rockframe.paper.claim import Claim, text_claims
from rockframe.paper.equations import impact_claims, misprint_claims, motion_claims
from rockframe.paper.parameters import (
    block_claims,
    bridge_claims,
    frame_claims,
    one_column_claims,
    temple_claims,
)
from rockframe.paper.pulses import pulse_claims
from rockframe.paper.stability import stability_claims


def all_claims() -> list[Claim]:
    """Check all claims that need no records, which takes a few seconds."""
    groups = (
        block_claims,
        motion_claims,
        one_column_claims,
        misprint_claims,
        frame_claims,
        impact_claims,
        pulse_claims,
        stability_claims,
        temple_claims,
        bridge_claims,
        text_claims,
    )
    return [claim for group in groups for claim in group()]
