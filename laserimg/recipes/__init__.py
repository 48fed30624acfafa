"""Recipes: detectors trained on simulated scans alone, each by one file."""
