"""The parts of `tools/paper_experiment.py`: paper 1's experiment on simulated scans."""
