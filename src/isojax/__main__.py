"""`python -m isojax`."""

import sys

from ._cli import main

sys.exit(main())
