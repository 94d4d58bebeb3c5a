from .document import check_drawable
from .live import check_live
from .writing import REPORT_FILE, write_report

__all__ = ["REPORT_FILE", "check_drawable", "check_live", "write_report"]
