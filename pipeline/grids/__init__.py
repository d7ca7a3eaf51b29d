"""Occupancy grids: rasterise, inflate, ray-cast, frontiers, travel distances. Arrays in, arrays out."""
