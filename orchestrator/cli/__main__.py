"""``python -m railcosim.orchestrator.cli``."""

from . import main

main()
