"""Hinterland: from floor plans to a cost ratio, for robots that navigate buildings they have not seen."""
