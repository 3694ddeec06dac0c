"""The motion commands: what a model says of tables of poses, written and drawn."""
