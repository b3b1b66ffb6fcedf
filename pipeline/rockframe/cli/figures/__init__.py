"""The command `figure`, and the figures that it draws."""
