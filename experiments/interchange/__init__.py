"""Motion through the programs that people take it to and from: what arrives."""
