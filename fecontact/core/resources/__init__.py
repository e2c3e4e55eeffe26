"""Memory and threads of the computer."""
