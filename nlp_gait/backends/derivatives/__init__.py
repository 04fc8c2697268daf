"""An NLP's functions with first and second derivatives as native code: samples as arithmetic, the rest as a plan."""
