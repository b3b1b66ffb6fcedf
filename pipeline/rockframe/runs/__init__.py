"""Runs of studies: plan, steps, stamps, lock, manifest. What a step does is the stages' affair."""
