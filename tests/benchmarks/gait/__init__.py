"""When feet strike and leave the ground: the truth of rendered films, what is learned, what is reached."""
