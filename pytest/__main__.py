"""What `uv run pytest` starts at the root of the repository: pytest, with the dependencies that only tests need.

A group that `uv run pytest` brings by default would also be downloaded by `uv run scantruss demo`. uv prefers a folder
of the command's name to the command; so this folder asks for the group, and the demo stays free of it. Elsewhere, or
without uv, plain pytest is found as ever: a folder without `__init__.py` does not hide an installed package.
"""

import os
import subprocess
import sys

uv = os.environ.get("UV", "uv")  # uv names itself to what it starts
sys.exit(subprocess.call([uv, "run", "--group", "test", "python", "-m", "pytest", *sys.argv[1:]]))
