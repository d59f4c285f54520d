"""The 95% interval of a share."""

import math


def wilson(successes, trials):
    """Score interval (Wilson, 1927)."""
    z = 1.959963984540054
    p = successes / trials
    center = (p + z * z / (2 * trials)) / (1 + z * z / trials)
    half = z / (1 + z * z / trials) * math.sqrt(p * (1 - p) / trials + z * z / (4 * trials**2))
    return max(0, center - half), min(1, center + half)
