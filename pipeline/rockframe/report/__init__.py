"""The report of a run: one HTML page that works from disk. It computes no physics.

Template, style and script are in this folder; `web` holds the parts that pages share.
"""
