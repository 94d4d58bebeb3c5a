"""Train cruise controllers."""
