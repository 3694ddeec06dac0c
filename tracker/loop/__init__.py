"""Frame after frame: propose, register, fuse."""
