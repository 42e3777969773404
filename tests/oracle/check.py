"""Error of an oracle's self-check."""

from __future__ import annotations


class SelfCheckError(Exception):
    """The oracle is inconsistent; its files are invalid."""


def require(holds: bool, what: str) -> None:
    if not holds:
        raise SelfCheckError(what)


def require_close(what: str, value: float, expected: float, tolerance: float) -> None:
    """`tolerance` is absolute, in the unit of `value`."""
    require(
        abs(value - expected) <= tolerance,
        f"{what}: computed {value!r}, expected {expected!r} within {tolerance:g}",
    )
