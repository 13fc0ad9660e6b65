"""From files to one clean point cloud (Sec. 2)."""
