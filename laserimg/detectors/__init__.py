"""Detectors: one file an algorithm, each with one method that proposes candidates."""
