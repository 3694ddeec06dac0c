"""`python -m tracker` is `figtrack`."""

from tracker.cli.app import main

if __name__ == "__main__":  # processes that a batch starts read this file too
    main()
