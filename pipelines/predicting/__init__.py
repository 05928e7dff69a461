"""What `undergrowth predict` is made of: images of any source, skeletons over time, what is written."""
