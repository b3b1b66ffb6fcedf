"""The user's TOML files as strict models, and the bundled structures and records."""
