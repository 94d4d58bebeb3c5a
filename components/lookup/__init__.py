"""Tables and networks: what equations know by numbers, not by a formula."""
