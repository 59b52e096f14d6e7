"""What sampled signals tell without a model of the rig: speeds, turning points, spikes, decay."""
