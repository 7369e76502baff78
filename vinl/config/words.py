"""Numbers and things in sentences."""


def count_things(number: int, thing: str) -> str:
    """``1 home``, ``20 homes``: a number and what there are so many of, for words that take an s."""
    return f"{number} {thing}{'s' * (number != 1)}"
