"""Figures: one a file, drawn from datasets; they compute nothing but where to look."""

from rockframe.figures.response_history import draw_response_history as draw_response_history
from rockframe.figures.style import save as save
