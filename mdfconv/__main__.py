"""Run the command line: ``python -m mdfconv``, and the program ``mdfconv``."""

import sys


def main() -> None:
    """Run the command line; a Ctrl-C during its imports ends it as any other does."""
    try:
        from mdfconv.cli import main as command_line
    except KeyboardInterrupt:
        sys.exit(130)
    command_line()


if __name__ == "__main__":
    main()
