"""`python -m tracker` is `figtrack`."""

from tracker.cli import main

main()
