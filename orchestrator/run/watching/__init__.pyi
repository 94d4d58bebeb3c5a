from .divergence import explain_divergence
from .finding import Finding, Kind
from .watching import Watching

__all__ = ["Finding", "Kind", "Watching", "explain_divergence"]
