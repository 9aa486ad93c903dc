"""`python -m warpdyn` is the command `warpdyn`; without arguments it is `warpdyn self-test`."""

import sys

from warpdyn.interfaces.command_line.program import main

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:] or ["self-test"]))
