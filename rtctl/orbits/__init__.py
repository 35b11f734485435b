"""Motions under a periodic drive: where they settle, their period, and how neighbours diverge."""
