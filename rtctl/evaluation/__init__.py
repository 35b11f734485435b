"""Scores of a run: tracking and self-sensing errors, settled setpoint holds, the summary."""
