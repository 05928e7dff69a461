"""Messages of ROS out of and into those of the on-line system, by rosbags; ROS itself is not needed."""
