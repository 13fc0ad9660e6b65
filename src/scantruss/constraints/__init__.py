"""Lines of the scan that become chains of members: those the user gives, and its sharp ridges."""
