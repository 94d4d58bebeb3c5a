from .page import write_study

__all__ = ["write_study"]
