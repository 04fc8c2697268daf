"""What does each limit cost?"""
