"""From a grid to a structure: sections, supports, loads, linear statics and checks; metres, newtons and kilograms."""
