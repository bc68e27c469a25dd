"""All methods of the three papers on one table: the same body, data, starts and measures."""
