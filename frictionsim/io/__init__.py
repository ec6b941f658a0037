"""Files: results, sweeps and tables in HDF5 and CSV, written whole or not at all, read safely."""
