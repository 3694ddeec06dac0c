"""One page for all steps: people in the films of a folder are found, followed, corrected and exported."""
