"""Where positives and negatives for training come from."""
