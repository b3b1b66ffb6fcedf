"""Rocking: what shakes the frame, the kernel, and the response around it."""

from rockframe.rocking.batch import Peaks as Peaks
from rockframe.rocking.batch import respond_many as respond_many
from rockframe.rocking.excitation import GroundAcceleration as GroundAcceleration
from rockframe.rocking.response import Response as Response
from rockframe.rocking.response import Verdict as Verdict
from rockframe.rocking.response import respond as respond
