"""How an ideal plate rings."""
