"""`python -m mavframecheck` is the `mavframecheck` command."""

from mavframecheck.cli import main

main(prog_name="mavframecheck")
