"""Trained weights made ready to ship: rounded, with starts and a card."""
