"""What surrounds the trains: schedules, wind, line, radio, sensors."""
