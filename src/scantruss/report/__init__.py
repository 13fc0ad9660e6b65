"""What a run shows its user: figures, advice on lengths, the terminal, and the pages of a sweep."""
