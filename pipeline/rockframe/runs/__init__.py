"""Runs of studies: plan, steps, stamps, lock, manifest. What a step does is the stages' affair."""

from rockframe.runs.graph import INPUTS as INPUTS
from rockframe.runs.graph import STRUCTURES as STRUCTURES
from rockframe.runs.lock import is_locked as is_locked
from rockframe.runs.lock import locked as locked
from rockframe.runs.manifest import changed_inputs as changed_inputs
from rockframe.runs.manifest import finish as finish
from rockframe.runs.performing import Work as Work
from rockframe.runs.performing import do as do
from rockframe.runs.performing import perform as perform
from rockframe.runs.plan import KEPT as KEPT
from rockframe.runs.plan import Input as Input
from rockframe.runs.plan import Plan as Plan
from rockframe.runs.plan import make_plan as make_plan
from rockframe.runs.plan_file import read_plan as read_plan
from rockframe.runs.plan_file import write_plan as write_plan
from rockframe.runs.recompute import recompute as recompute
from rockframe.runs.run import Outcome as Outcome
from rockframe.runs.run import Watch as Watch
from rockframe.runs.run import prepare as prepare
from rockframe.runs.run import run_plan as run_plan
from rockframe.runs.run import status_of as status_of
from rockframe.runs.state import StepState as StepState
from rockframe.runs.state import damaged as damaged
from rockframe.runs.state import stamp as stamp
from rockframe.runs.step import Step as Step
from rockframe.runs.step import waves as waves
