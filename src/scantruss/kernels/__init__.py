"""Compiled loops on plain arrays; nothing here imports the rest of the package."""

of_command = False  #: whether this process is a command of ours, where nobody else has functions to compile
