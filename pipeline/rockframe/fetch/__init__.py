"""Download records from FDSN data centres, check them, and keep them as received."""

import warnings

with warnings.catch_warnings():
    # obspy 1.5 looks up its entry points in a way that Python 3.11 deprecates.
    warnings.simplefilter("ignore", DeprecationWarning)
    import obspy  # noqa: F401  # here once, so that no module of this room sees the warning
