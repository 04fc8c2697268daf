"""How does the optimum move with one or two parameters?"""
