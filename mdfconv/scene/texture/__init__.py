"""Textures of a parameter."""
