"""The program ``yfslam``: installing the package installs it."""

import os
import shutil
import signal
import sys

from . import _yfslam


def main() -> int:
    """Run the program with the arguments of this process."""
    # The program has its own handling of Ctrl-C, which Python's handler would only delay.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    # `yfslam bench` starts the program again; with `python -m yfslam` that is the script beside the interpreter.
    folders = os.pathsep.join([os.path.dirname(sys.executable), os.environ.get("PATH", os.defpath)])
    script = sys.argv[0] if os.access(sys.argv[0], os.X_OK) else shutil.which("yfslam", path=folders)
    return _yfslam.run_program(["yfslam", *sys.argv[1:]], script or sys.argv[0], _yfslam.__file__)
