"""Geometry of a scan: pitch between rays, planes, floor."""
