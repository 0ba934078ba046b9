"""The Sun, the Moon and the planets at real dates."""
