"""Planes, the floor and the angular pitch: what is known of a scan's geometry before any image."""
