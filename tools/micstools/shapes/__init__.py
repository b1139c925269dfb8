"""Blocks and beds: geometry, shapes made of tetrahedra, meshing, maps of heights."""
