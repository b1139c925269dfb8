"""Shares of outcomes with their intervals."""

from collections import Counter
from collections.abc import Iterable
from math import sqrt
from statistics import NormalDist
from typing import Any


def wilson(count: int, total: int, confidence: float = 0.95) -> tuple[float, float]:
    """Interval of a share of which `count` of `total` were seen.

    Source: Wilson, Probable inference, the law of succession, and statistical inference (1927).
    """
    if not total:
        return 0.0, 1.0
    z = NormalDist().inv_cdf(0.5 + confidence / 2)
    share, spread = count / total, z * z / total
    middle = (share + spread / 2) / (1 + spread)
    half = z * sqrt((share * (1 - share) + spread / 4) / total) / (1 + spread)
    return max(0.0, middle - half), min(1.0, middle + half)


def in_words(count: int, total: int) -> str:
    """As in `3 of 8 (38 %, 14 to 69)`."""
    low, high = wilson(count, total)
    share = 100 * count / total if total else 0
    return f"{count} of {total} ({share:.0f} %, {100 * low:.0f} to {100 * high:.0f})"


def table(counted: Counter[str], total: int, names: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Count, share and its 95 % interval of each name."""
    return {
        name: {
            "count": counted[name],
            "share": counted[name] / total if total else None,
            "interval_95": list(wilson(counted[name], total)),
        }
        for name in names
    }
