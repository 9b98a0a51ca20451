"""``python3 -m duet ...`` is the program ``duet ...``."""

import os
import sys

from .errors import Error
from .program import path


def main() -> None:
    """Becomes the program."""
    try:
        program = path()
    except Error as error:
        sys.exit(f"duet: {error}")
    os.execv(program, ["duet", *sys.argv[1:]])


if __name__ == "__main__":
    main()
