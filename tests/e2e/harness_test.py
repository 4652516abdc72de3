"""Tests of the functions by which the end-to-end tests measure errors."""
import math
import unittest

import harness


class Alignment(unittest.TestCase):
    def test_finds_the_similarity(self):
        half = math.radians(100) / 2
        axis = [0.36, 0.48, 0.8]
        sim = (2.5, [math.sin(half) * a for a in axis] + [math.cos(half)], [1.0, -2.0, 0.5])
        points = [[math.sin(i), 0.3 * math.cos(2.3 * i), 0.2 * i] for i in range(12)]
        found = harness.similarity([(p, harness.apply(sim, p)) for p in points])
        self.assertLess(max(math.dist(harness.apply(found, p), harness.apply(sim, p)) for p in points), 1e-9)
        self.assertAlmostEqual(found[0], 2.5)


if __name__ == "__main__":
    unittest.main()
