"""What GaitBench ships, made anew: best known points and probes (``known``), baseline records (``baseline``)."""
