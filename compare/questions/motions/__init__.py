"""What do richer motions save?"""
