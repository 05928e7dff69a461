"""Makes occluders out of meshes of others: upright, in metres, turned to their user, with surfaces and solids."""
