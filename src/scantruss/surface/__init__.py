"""The scanned surface at the scale of a member: samples, normals and the size field."""
