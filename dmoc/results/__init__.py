"""What a solve found, kept."""
