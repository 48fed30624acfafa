"""Parametric scenes."""
