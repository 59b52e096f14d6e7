"""What in the data is not of the rig: trips, outliers, reversed sensors."""
