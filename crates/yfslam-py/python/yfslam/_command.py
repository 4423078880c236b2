"""The program ``yfslam``: installing the package installs it."""

import signal
import sys

from . import _yfslam


def main() -> int:
    """Run the program with the arguments of this process."""
    # The program has its own handling of Ctrl-C, which Python's handler would only delay.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _yfslam.run_program(["yfslam", *sys.argv[1:]])
