"""`python -m mavframecheck` is the `mavframecheck` command."""

from mavframecheck.cli import main

if __name__ == "__main__":  # worker processes import this module too
    main(prog_name="mavframecheck")
