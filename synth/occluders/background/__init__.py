"""What belongs to a room and has no occluder class of its own: shelves, curtains, pillars, coats on a stand."""
