"""Words of the page: messages that name options of the command line name the fields of the page instead."""

from __future__ import annotations

import re

#: what is said on the command line, and on the page; the longer first
PHRASES = tuple(
    (re.compile(said), on_page)
    for said, on_page in (
        (r"give scantruss grid --fixed X,Y,Z", "place some in Constraints, Fixed nodes"),
        (r"with --supports:", "in supports:"),
        (r", a node such as N001 or a file of positions", " or a node such as N001"),
        (r"support some nodes, as with --supports (\w+)", r"support some nodes, such as \1 in supports"),
        (r"as with --support-type (\w+)", r'such as \1 in "held as"'),
        (r"leave --symmetry out", "choose no symmetry in Constraints"),
        (r"close the hole with --fill-at", "close the hole in Design, Holes and ridges"),
        (r"--ridge-angle 0", "follow no ridge (Design, Holes and ridges)"),
        (r"leave --size out", "set most sections to 0 in Sizing and modes"),
        (r"heavier --section", "heavier section"),
        (r"check --scale (\S+) and", r"check the scale \1 and"),
        (r"check --scale and", "check the scale and"),
        (r"(?:give it with|give) --unit(?: (?:\w+\|)+\w+|,? (?:one of )?(?:\w+, )*\w+ or \w+)?", "choose it in Scan, unit"),
        (r"leave --unit out", "choose that unit in Scan"),
        (r"another --length", "another length"),
        (r"irregular (\d+), forced (\d+)", r"members too many or too few at nodes: \1, of which the shape needs \2"),
        (r"use --joints rigid", 'say rigid in "joints"'),
        (r"\(--rows curvature\)", "(Design, rows follow)"),
        (r"(?:make it with|give it) --loads", "name some in loads, and press Run"),
        (r"with --crop or --piece", "with Scan, Crop"),
        (r"; --node-allowance 0\.15 adds 15 % of that of the members", "; the schedules in Out say how much balls weigh"),
        (r"turn the scan first, (?:as scantruss studio does|so that z is)", "choose that in Scan, up"),
        (r"; --keep-failed (?:gives it all the same|uses it anyway)", ""),
    )
)  # fmt: skip
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]+")
OF_COMMAND_LINE = "what begins with -- is an option of the command line"


def in_words_of_page(message: str) -> str:
    """Return a message with the names that things have on the page; what it has no field for is said to be of the command line."""
    for said, on_page in PHRASES:
        message = said.sub(on_page, message)
    return f"{message} ({OF_COMMAND_LINE})" if OPTION.search(message) else message
