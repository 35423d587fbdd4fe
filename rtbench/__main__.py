"""``python -m rtbench``: the command line."""

from rtbench.cli import main

main()
