"""What generators are made of: specs, parts, primitive shapes, joints."""
