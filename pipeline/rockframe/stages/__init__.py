"""The stages: functions that read files, compute, and write files."""
