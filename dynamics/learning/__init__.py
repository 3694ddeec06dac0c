"""Learning by expectation-maximisation."""
