"""What a real-time FMU brings for hosts without an importer, and how many instructions a step of it takes."""

from .bare import FOLDER, StepCost, files, has_counter, step_cost

__all__ = ["FOLDER", "StepCost", "files", "has_counter", "step_cost"]
