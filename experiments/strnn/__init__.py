"""STRNN: what it foretells, and what becomes of it in open loop; the claims S."""
