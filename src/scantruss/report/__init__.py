"""What a run tells its user: figures, the terminal, and files that appear all together or not at all."""
