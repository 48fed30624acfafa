"""File formats: scans, side files, TOML, cards, COCO."""
