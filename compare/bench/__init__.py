"""GaitBench's ranking: runs of a solver on the suite against shipped records of others."""
