"""Run the command line: ``python -m mdfconv``."""

from mdfconv.cli import main

if __name__ == "__main__":
    main()
