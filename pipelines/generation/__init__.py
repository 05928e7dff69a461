"""Where the frames of a generated corpus come from: drawn scenes, or objects composed before recorded people."""
