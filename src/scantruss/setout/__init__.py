"""Setting out: where supports, heights and boundaries lie on site, and in which order rings of members are put up."""
