"""Schedules: what a workshop needs to make the nodes, members and panels of a grid."""
