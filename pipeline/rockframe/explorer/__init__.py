"""The live page: a server computes the response for the settings of the sliders.

Only the server needs the extra ``explorer``.
"""
