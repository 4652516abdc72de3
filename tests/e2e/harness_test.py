"""Tests of the functions by which the end-to-end tests measure errors."""
import harness
import numpy as np
import pytest


def test_finds_the_similarity():
    half = np.radians(100) / 2
    turn = harness.rotation([*(np.sin(half) * np.array([0.36, 0.48, 0.8])), np.cos(half)])
    assert turn @ [0.36, 0.48, 0.8] == pytest.approx([0.36, 0.48, 0.8])
    sim = (2.5, turn, [1.0, -2.0, 0.5])
    points = [[np.sin(i), 0.3 * np.cos(2.3 * i), 0.2 * i] for i in range(12)]
    found = harness.similarity([(p, harness.apply(sim, p)) for p in points])
    assert found[0] == pytest.approx(2.5)
    assert max(harness.distances([(p, harness.apply(sim, p)) for p in points], found)) < 1e-9
