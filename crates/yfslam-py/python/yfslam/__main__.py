"""``python -m yfslam`` is the program ``yfslam``."""

import sys

from ._command import main

sys.exit(main())
