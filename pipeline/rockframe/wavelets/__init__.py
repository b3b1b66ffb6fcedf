"""Wavelets and the acceleration pulses that they describe, in closed form."""
