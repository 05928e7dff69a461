"""People over time: gait that follows from footfalls, sitting down and getting up, gestures, captured motion."""
