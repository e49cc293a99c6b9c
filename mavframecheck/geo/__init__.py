"""Geometry: arrays in, arrays out."""
