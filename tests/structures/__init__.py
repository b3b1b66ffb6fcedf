"""Tests of kinds of structures."""
