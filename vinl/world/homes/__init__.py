"""Procedural homes: rooms, doors and furniture, every one different, each the same again from its seed."""

from vinl.world.homes.config import HomeConfig
from vinl.world.homes.generate import generate_home

__all__ = ["HomeConfig", "generate_home"]
