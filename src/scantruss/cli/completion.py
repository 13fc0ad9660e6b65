"""``scantruss completion``: a script with which a shell completes commands, options and their values."""

from __future__ import annotations

from argparse import Namespace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .options import Parser

Parsers = dict[str, "Parser"]
SHELLS = ("bash", "zsh", "fish")

_BASH = """\
_scantruss() {{
    local word="${{COMP_WORDS[COMP_CWORD]}}" before="${{COMP_WORDS[COMP_CWORD-1]}}" words=""
    if [ "$COMP_CWORD" -eq 1 ]; then
        COMPREPLY=($(compgen -W "{commands} --help --version" -- "$word"))
        return
    fi
    case "${{COMP_WORDS[1]}} $before" in
{values}
    esac
    if [ -z "$words" ] && [ "${{word:0:1}}" = "-" ]; then
        case "${{COMP_WORDS[1]}}" in
{options}
        esac
    fi
    if [ -n "$words" ]; then COMPREPLY=($(compgen -W "$words" -- "$word"));
    else COMPREPLY=($(compgen -f -- "$word")); fi
}}
complete -o filenames -F _scantruss scantruss
"""


def completion_parser() -> Parser:
    """Options of ``scantruss completion``."""
    from .options import Parser

    parser = Parser(
        "completion",
        "|".join(SHELLS),
        "Print a script that lets your shell complete commands and options.\n"
        'bash: eval "$(scantruss completion bash)" in ~/.bashrc; zsh: the same with zsh in ~/.zshrc;\n'
        "fish: scantruss completion fish > ~/.config/fish/completions/scantruss.fish",
    )
    parser.add_argument("shell", metavar="SHELL", choices=SHELLS, help=" or ".join(SHELLS))
    return parser


def print_completion(values: Namespace, parsers: Parsers) -> None:
    """Print the script for a shell, of the parsers of all commands by their names."""
    from ..report.terminal import print_lines

    print_lines([_fish(parsers) if values.shell == "fish" else _bash(values.shell, parsers)])


def _options(parser: Parser) -> dict[str, tuple[str, str]]:
    """Return the long options of a command, each with its values that are words, separated by spaces, and its help."""
    found = {}
    for action in parser._actions:
        words = str(action.metavar or "").split("|")
        values = " ".join(word for word in words if len(words) > 1 and word == word.lower())
        values = " ".join(action.choices) if action.choices else values
        found.update({name: (values, (action.help or "")) for name in action.option_strings if name.startswith("--")})
    return found


def _bash(shell: str, parsers: Parsers) -> str:
    """Return the script for bash; zsh reads it by its own translation."""
    options, values = [], []
    for name, parser in parsers.items():
        known = _options(parser)
        options.append(f'            {name}) words="{" ".join(known)}" ;;')
        values += [f'        "{name} {option}") words="{words}" ;;' for option, (words, _) in known.items() if words]
    values.append(f'        "completion completion") words="{" ".join(SHELLS)}" ;;')
    script = _BASH.format(commands=" ".join(parsers), values="\n".join(values), options="\n".join(options))
    return ("autoload -U +X bashcompinit && bashcompinit\n" if shell == "zsh" else "") + script.rstrip()


def _fish(parsers: Parsers) -> str:
    """Return the script for fish."""
    lines = [f"complete -c scantruss -n __fish_use_subcommand -f -a '{' '.join(parsers)}'"]
    for name, parser in parsers.items():
        when = f"-n '__fish_seen_subcommand_from {name}'"
        for option, (words, about) in _options(parser).items():
            short = about.replace("%%", "%").split(";")[0].replace("'", "\\'")
            takes = f" -x -a '{words}'" if words else ""
            lines.append(f"complete -c scantruss {when} -l {option[2:]}{takes} -d '{short}'")
    lines.append(f"complete -c scantruss -n '__fish_seen_subcommand_from completion' -x -a '{' '.join(SHELLS)}'")
    return "\n".join(lines)
