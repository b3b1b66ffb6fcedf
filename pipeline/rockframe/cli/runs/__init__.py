"""Commands that perform or check runs, one module each."""
