"""Feet: when they are down, put back on the ground of another body, held still where they rest.

`contacts` labels them, `planting` serves retargeting, `lock` holds them by their labels. Each is
imported by itself: planting is needed before there is a Motion, the others work on one.
"""
