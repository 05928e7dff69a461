"""Pictures: colours, frames, skeletons, contact sheets; all BGR arrays, as OpenCV draws."""
