"""Simulated scans: scenes of meshes, cast by models of laser scanners."""
