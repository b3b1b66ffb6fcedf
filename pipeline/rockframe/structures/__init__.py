"""Kinds of structures: the contract that stages call (contract.py), and the kinds that keep it."""
