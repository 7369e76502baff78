"""What a notebook says in one line. The names are those of ``vinl`` itself; pictures and films show themselves."""
