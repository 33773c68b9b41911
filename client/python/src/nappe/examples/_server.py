"""What the examples share: the options that name a server, and the server that they name."""

from __future__ import annotations

import argparse
from pathlib import Path

import nappe


class _Help(argparse.ArgumentDefaultsHelpFormatter):
    """Tells the default of each option that has one."""

    def _get_help_string(self, action: argparse.Action) -> str | None:
        return action.help if action.default is None else super()._get_help_string(action)


def parser(description: str | None) -> argparse.ArgumentParser:
    """A parser of options that has `--server` and `--token-file`; `description` is the docstring of the example."""
    first_sentence = (description or "").partition("\n")[0]
    made = argparse.ArgumentParser(description=first_sentence, formatter_class=_Help)
    made.add_argument("--server", metavar="URL", help="a server that runs, such as 127.0.0.1:6277 (default: a new one)")
    made.add_argument("--token-file", metavar="FILE", type=Path, help="file whose first line is the server's token")
    return made


def opened(options: argparse.Namespace) -> nappe.Server:
    """The server that the options name, or a new one. To be used with `with`, which also ends a new one."""
    if options.server is None:
        return nappe.serve()
    return nappe.connect(options.server, options.token_file)
