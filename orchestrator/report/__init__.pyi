from .document import check_drawable
from .writing import REPORT_FILE, write_report

__all__ = ["REPORT_FILE", "check_drawable", "write_report"]
