"""Parts that all pages share: plots, the drawing of the frame, style and security policy.

uPlot, in `vendor`, draws the plots.
"""
