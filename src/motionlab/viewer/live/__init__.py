"""What lives in a notebook's kernel or in a built page: players, scenes, dreams and knobs."""
