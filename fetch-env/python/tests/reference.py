"""Comparing with gymnasium-robotics, bit for bit."""

import numpy as np

#: What the reference's numpy rounds by processor: its BLAS sums velocities in its own order, and
#: its arctangent may differ in the last bit. See fetch-env's FIDELITY.md.
ROUNDED = {10: slice(5, 8), 25: slice(11, 23)}
ROUNDING = 1e-15


def bits(numbers):
    """Return the bits of numbers as integers."""
    return np.ascontiguousarray(numbers, np.float64).view(np.uint64)


def assert_same_observation(ours, theirs):
    """Compare observations of one or of many environments."""
    assert ours.keys() == theirs.keys()
    for key, numbers in ours.items():
        other = theirs[key].copy()
        assert numbers.dtype == other.dtype
        assert numbers.shape == other.shape
        if key == "observation":
            rounded = ROUNDED[numbers.shape[-1]]
            difference = numbers[..., rounded] - other[..., rounded]
            assert np.abs(difference).max() <= ROUNDING
            other[..., rounded] = numbers[..., rounded]
        np.testing.assert_array_equal(bits(numbers), bits(other), key)


def assert_same_info(ours, theirs):
    """Compare infos, with the types of their values."""
    assert ours.keys() == theirs.keys()
    for key, value in ours.items():
        other = theirs[key]
        assert type(value) is type(other), key
        if isinstance(value, dict):
            assert_same_info(value, other)
        elif key == "final_obs":
            for one, another in zip(value, other, strict=True):
                assert (one is None) == (another is None)
                if one is not None:
                    assert_same_observation(one, another)
        else:
            assert np.asarray(value).dtype == np.asarray(other).dtype, key
            np.testing.assert_array_equal(value, other, key)
