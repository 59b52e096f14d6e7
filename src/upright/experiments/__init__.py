"""What can be learned without a rig? The experiments of the paper on its digital twin."""
