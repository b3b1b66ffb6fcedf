"""The command line: one module per command. Slow imports are made only when a command runs."""
