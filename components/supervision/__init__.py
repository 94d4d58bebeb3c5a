"""What plans and watches a train's trips: timetable (ATS) and protection (ATP)."""
