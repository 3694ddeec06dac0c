"""One page for the whole way: films of a folder found, followed, put right and exported."""
