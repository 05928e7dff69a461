"""Live topics: the same messages over ROS 1 and over ROS 2."""
