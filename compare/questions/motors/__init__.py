"""What do the real motors change?"""
