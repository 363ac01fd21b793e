"""The parts of the pages that docs/generate.py writes."""
