"""Commands of the command line that are more than a call; `motionlab.__main__` lists them all."""
