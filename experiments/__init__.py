"""Scripts whose results the project keeps, by subject; from the root: python -m experiments.FOLDER.NAME."""
