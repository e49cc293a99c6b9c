"""`mavframecheck completion SHELL`: the script that makes a shell complete the command."""

from __future__ import annotations

import click
from click.shell_completion import get_completion_class

from mavframecheck.cli.output import echo

PROGRAM = "mavframecheck"
VARIABLE = "_MAVFRAMECHECK_COMPLETE"
"""With this in its environment the program answers the shell instead of running."""


@click.command()
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@click.pass_context
def completion(ctx: click.Context, shell: str) -> None:
    """Write the completion script of a shell.

    bash: mavframecheck completion bash >> ~/.bashrc

    zsh: mavframecheck completion zsh >> ~/.zshrc

    fish: mavframecheck completion fish > ~/.config/fish/completions/mavframecheck.fish
    """
    kind = get_completion_class(shell)
    if kind is None:
        raise click.UsageError(f"click cannot complete in {shell}")
    echo([kind(ctx.find_root().command, {}, PROGRAM, VARIABLE).source(), "\n"])
