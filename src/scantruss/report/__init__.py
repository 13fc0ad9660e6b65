"""What a run tells its user: figures, advice on lengths, the terminal, and the pages of a sweep."""
