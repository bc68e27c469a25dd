"""What the papers claim, our rules, the verdicts; assumptions and deviations."""
