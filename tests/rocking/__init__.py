"""Tests of the rocking response; a package so that they can share the independent solver."""
