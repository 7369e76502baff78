"""Which share of the episodes one machine walks."""

from __future__ import annotations

from dataclasses import dataclass

from vinl.config.errors import InputError


@dataclass(frozen=True)
class Shard:
    """A share of the episodes: those whose number leaves ``index`` - 1 when divided by ``count``."""

    index: int = 1
    count: int = 1

    @classmethod
    def parse(cls, text: str) -> Shard:
        """``"2/5"``.

        Raises:
            InputError: it is not of that form, or out of range.
        """
        parts = text.split("/")
        if len(parts) != 2 or not all(part.strip().isdigit() for part in parts):
            raise InputError(f"--shard must be of the form 2/5, got {text!r}")
        index, count = map(int, parts)
        if not 1 <= index <= count:
            raise InputError(f"--shard {text}: the first number must lie between 1 and the second")
        return cls(index, count)

    def holds(self, number: int) -> bool:
        """Whether an episode's number, from 0 on, is in this share."""
        return number % self.count == self.index - 1

    def __str__(self) -> str:
        return f"{self.index}/{self.count}"
