"""Chapters 3, 5 and 6: the generator of RNN-GAN, its refiner, and contacts; the claims W."""
