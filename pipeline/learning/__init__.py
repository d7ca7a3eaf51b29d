"""From labelled rows to trained weights: examples, batches, fit, calibration, scores, weights files."""
