"""Runs of studies: plan, steps, stamps, lock and manifest. The stages do the work of each step."""
