"""The parts of obspy used for downloads, imported only here."""

from __future__ import annotations

import warnings

with warnings.catch_warnings():
    # obspy 1.5 looks up its entry points in a way that Python 3.11 deprecates.
    warnings.simplefilter("ignore", DeprecationWarning)
    from obspy import Inventory as Inventory
    from obspy import Stream as Stream
    from obspy import UTCDateTime as UTCDateTime
    from obspy import read as read
    from obspy import read_events as read_events
    from obspy import read_inventory as read_inventory
    from obspy.clients.fdsn import Client as Client
    from obspy.clients.fdsn.header import FDSNException as FDSNException
    from obspy.core.util.obspy_types import ObsPyException as ObsPyException
    from obspy.geodetics import gps2dist_azimuth as gps2dist_azimuth
    from obspy.io.mseed.util import get_record_information as get_record_information
