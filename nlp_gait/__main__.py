"""``python -m nlp_gait`` is the console script.

Python puts the current folder in front of all that is installed, and a user's own ``compare.py`` would be taken for the
package's ``compare``: with ``-m`` the folder counts only if the package itself lies in it.
"""

import os
import sys
from contextlib import suppress
from pathlib import Path

with suppress(FileNotFoundError):  # main reports a working folder that is gone
    if sys.path[0] in ("", os.getcwd()) and Path(__file__).parents[1] != Path.cwd():
        del sys.path[0]

from compare.__main__ import main

main()
