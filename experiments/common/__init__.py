"""What several of them share: how results are written, rollouts and their fate, many trainings."""
