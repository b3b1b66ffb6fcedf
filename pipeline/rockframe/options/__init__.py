"""The options of each stage, one frozen model each, from which all interfaces are derived."""
