from .page import REPORT_FILE, check_drawable, write_report

__all__ = ["REPORT_FILE", "check_drawable", "write_report"]
