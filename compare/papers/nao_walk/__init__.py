"""What others measured on NAO and said of its walk, each claim held against the model and the engine."""
