"""COSMOS V0, V1, V2 and V2c."""
