"""GaitBench's leaderboard: an algorithm's runs on the suite beside shipped records of others."""
