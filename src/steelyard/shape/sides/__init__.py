"""Which side of a surface is outside: winding numbers, neighbours on one sheet, walls that face each other."""
