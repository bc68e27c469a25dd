"""Recorded motion: tables of it, and what was fitted to it or measured on it."""
