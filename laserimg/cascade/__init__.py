"""Haar and LBP cascades: features, training, and the XML that OpenCV runs."""
