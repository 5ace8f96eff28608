"""The program ``fetch-env``, also as ``python -m fetch_env``."""

import sys

from .program import main

if __name__ == "__main__":
    sys.exit(main())
