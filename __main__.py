"""``python -m accelscope``: the command line."""

import sys

from .addon.command import main

sys.exit(main())
