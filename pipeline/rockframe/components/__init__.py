"""Horizontal components of a motion: pairing, rotation, and measures over all azimuths."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
