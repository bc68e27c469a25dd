"""Chapter 4: auto-conditioned dancers and their rivals; the claims Z."""
