"""Short lists of meshes that each tool may choose from, from cheap to dear; arguments of its `solve`.

They were found by trying: methods, orders, numbers of steps and ways from coarse to fine that are not here cost
more for the same accuracy.
"""

MESHES: dict[str, dict[str, list[tuple]]] = {
    # method of transcription and numbers of segments, of which the later ones refine what the first found
    "asset": {
        "P2": [("LGL3", 12), ("LGL7", 4), ("LGL7", 8), ("LGL5", 16), ("LGL5", 42), ("LGL7", 32)],
        "P3": [("LGL7", 3), ("LGL7", 5), ("LGL7", 8), ("LGL7", 12)],
        "P4": [("LGL3", 20, 40), ("LGL3", 20, 160), ("LGL3", 20, 40, 160), ("LGL3", 20, 80, 240)],
        "P5": [("LGL5", 16), ("LGL7", 10), ("LGL7", 16), ("LGL7", 28), ("LGL7", 36)],
    },
    # scheme and numbers of steps, likewise; (16) is that of dmoc at order 2, as it is written down
    "casadi": {
        "P2": [
            ("Hermite-Simpson", 16),
            ("Legendre 3", 8),
            ("Legendre 4", 16),
            ("Legendre 4", 40),
        ],
        "P3": [("Hermite-Simpson", 8), ("Legendre 3", 6), ("Legendre 4", 6), ("Legendre 4", 12)],
        "P4": [
            ("(16)", 40, 160),
            ("Hermite-Simpson", 20, 40),
            ("Hermite-Simpson", 20, 40, 160),
            ("(16)", 40, 160, 640, 1280),
        ],
        "P5": [
            ("Hermite-Simpson", 50),
            ("Radau 3", 40),
            ("Legendre 4", 40),
            ("Legendre 6", 16),
            ("Legendre 6", 24),
        ],
    },
    # order and number of steps; or neither, and a tolerance
    "dmoc": {
        "P2": [(8, 4), (6, 6), (8, 14), (6, 20), (6, 40), (8, 30), (6, 80)],
        "P3": [(8, 5), (8, 6), (8, 8), (8, 14), (8, 16)],
        "P4": [(8, 16), (4, 40), (None, None, 9e-6), (None, None, 1e-7)],
        "P5": [(8, 44), (8, 80), (8, 140), (8, 150)],
    },
}
