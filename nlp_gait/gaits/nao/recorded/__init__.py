"""Gaits from elsewhere, as angles over time: judged by the limits of NAO's phases and of its cycle."""
