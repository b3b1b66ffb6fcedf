"""Selection of scaled motions whose response spectra match a target."""
