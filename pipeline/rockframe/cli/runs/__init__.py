"""Commands that perform and check runs, one module each."""
