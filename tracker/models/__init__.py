"""Motion models: found by name, learned from captures."""
