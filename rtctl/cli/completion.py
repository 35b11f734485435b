"""Scripts by which a shell completes verbs and options, made from the parser."""

from __future__ import annotations

import argparse
from collections.abc import Mapping

SHELLS = ("bash", "zsh", "fish")
_BASH = """# rtctl: eval "$(rtctl completion bash)"
_rtctl() {{
  local word="${{COMP_WORDS[COMP_CWORD]}}" words=""
  COMPREPLY=()
  if [ "$COMP_CWORD" -eq 1 ]; then
    words="{verbs}"
  elif [[ "$word" == -* ]]; then
    case "${{COMP_WORDS[1]}}" in
{cases}
    esac
  fi
  [ -n "$words" ] && COMPREPLY=($(compgen -W "$words" -- "$word"))
}}
complete -o default -F _rtctl rtctl
"""
_ZSH = """# rtctl: eval "$(rtctl completion zsh)"
autoload -U +X compinit && compinit -u
autoload -U +X bashcompinit && bashcompinit
"""


def completion_script(shell: str, parsers: Mapping[str, argparse.ArgumentParser]) -> str:
    """Return the script of a shell that completes the verbs, their options, and files.

    Args:
        shell: One of `SHELLS`.
        parsers: Parser of each verb.
    """
    options = {verb: _options(parser) for verb, parser in parsers.items()}
    if shell == "fish":
        return _fish(parsers, options)
    cases = "\n".join(f'      {verb}) words="{" ".join(words)}" ;;' for verb, words in options.items())
    script = _BASH.format(verbs=" ".join(parsers), cases=cases)
    return _ZSH + script if shell == "zsh" else script


def _options(parser: argparse.ArgumentParser) -> list[str]:
    return [
        option for action in parser._actions for option in action.option_strings if option.startswith("--")
    ]


def _fish(parsers: Mapping[str, argparse.ArgumentParser], options: Mapping[str, list[str]]) -> str:
    lines = ["# rtctl: rtctl completion fish | source"]
    lines += [f"complete -c rtctl -f -n __fish_use_subcommand -a {verb}" for verb in parsers]
    lines += [
        f"complete -c rtctl -n '__fish_seen_subcommand_from {verb}' -l {option.removeprefix('--')}"
        for verb, words in options.items()
        for option in words
    ]
    return "\n".join(lines) + "\n"
