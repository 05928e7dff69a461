"""Random walk forests (Jung et al. 2015): one expert a joint, one start point, one core."""
