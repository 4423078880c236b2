"""Runs the code of all notebooks, each in a process of its own, and keeps their figures.

    python tools/python/notebooks.py [FOLDER]       needs yfslam and matplotlib; with FOLDER, figures are written there
"""

from __future__ import annotations

import json
import os
import pathlib
import subprocess
import sys

END = """
import os as _os
for _number in plt.get_fignums():
    plt.figure(_number).savefig(_os.path.join(_os.environ["FIGURES"], _os.environ["NOTEBOOK"] + f"_{_number}.png"))
"""


def main() -> int:
    root = pathlib.Path(__file__).parents[2]
    figures = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else None
    if figures is not None:
        figures.mkdir(parents=True, exist_ok=True)
    failed = 0
    for path in sorted((root / "notebooks").glob("*.ipynb")):
        cells = json.loads(path.read_text())["cells"]
        sources = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
        # Each cell of a notebook begins a figure of its own; lines that begin with % are for Jupyter.
        code = "\nplt.figure()\n".join(source for source in sources if not source.startswith("%"))
        code = "import matplotlib.pyplot as plt\n" + code + (END if figures is not None else "")
        environment = {**os.environ, "MPLBACKEND": "Agg", "NOTEBOOK": path.stem, "FIGURES": str(figures)}
        done = subprocess.run([sys.executable, "-c", code], env=environment)
        print(f"{path.name}: {'ok' if done.returncode == 0 else 'FAILED'}", flush=True)
        failed += done.returncode != 0
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
