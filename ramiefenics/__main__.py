"""Run the command line by `python -m ramiefenics`."""

from ramiefenics.cli import main

main()
