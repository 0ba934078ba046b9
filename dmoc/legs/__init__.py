"""Parts of missions: legs, what happens between them, their ends and objectives."""
