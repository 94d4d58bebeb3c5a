"""How a component becomes an FMU."""
