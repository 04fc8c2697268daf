"""Recompute the data of GaitBench: best known points and probes (``facts``), baseline records (``baseline``)."""
