"""A robot in a world it has not seen: sense, decide, move, until the trial ends."""
