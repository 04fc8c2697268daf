"""A biped of nine links with toes that climbs stairs."""
