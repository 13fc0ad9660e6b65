"""What is tried where the first grid does not pass: one table of attempts, when each is made, and how many are worth making."""
