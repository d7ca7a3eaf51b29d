"""Floor plans in metres: readers and writers for each format, generators, checks."""
