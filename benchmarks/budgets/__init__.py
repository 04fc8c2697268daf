"""Who is best at which budget, from 100 to 1,000,000 evaluations."""
