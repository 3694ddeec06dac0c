"""Random commands on random films, some of them killed: whether every one ends as it is meant to."""
