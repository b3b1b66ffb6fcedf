"""Commands of the stages, one module each."""
