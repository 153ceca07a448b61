"""Pictures with clicks and masks, from the simulator: what the click segmenter learns from and is judged by."""
