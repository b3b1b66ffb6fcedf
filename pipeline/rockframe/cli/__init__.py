"""The command line: one module per verb; heavy imports wait until the verb runs."""
