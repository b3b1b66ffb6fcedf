"""Responses of isolated decks and monolithic frames, and their comparison with rocking frames."""

from rockframe.oscillators.response import OscillatorPeaks as OscillatorPeaks
from rockframe.oscillators.response import OscillatorResponse as OscillatorResponse
from rockframe.oscillators.response import respond_oscillator as respond_oscillator
from rockframe.oscillators.response import respond_oscillators as respond_oscillators
from rockframe.rivals import FixedFrame as FixedFrame
from rockframe.rivals import IsolatedDeck as IsolatedDeck
