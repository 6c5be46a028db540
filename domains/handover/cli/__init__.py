"""The commands `mlnlite handover ...`."""
