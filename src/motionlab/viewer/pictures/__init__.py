"""What makes pictures of motion: stills, film strips, videos, plots; the mannequin and its colours."""
