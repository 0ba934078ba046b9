"""Paths in the formats of other programs: tables, CCSDS OEM, CZML."""
