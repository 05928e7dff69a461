"""Where images come from: recordings of ROS, and whatever gives frames."""
