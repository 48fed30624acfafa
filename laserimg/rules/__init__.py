"""Rules: limits in metres that a candidate of a class must keep."""
