"""make fuzz: damages a sample of every format that is read, and asserts what readers promise about damaged files."""
