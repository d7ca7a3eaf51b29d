"""One folder per research system; none of them knows another."""
