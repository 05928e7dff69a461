"""Files of one depth image, by format: each module reads one kind as it is stored, whatever its unit."""
