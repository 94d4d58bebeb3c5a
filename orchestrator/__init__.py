"""The master orchestrator."""
