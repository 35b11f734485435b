"""Motions under a periodic drive: where they settle, of which period, how they part from their neighbours."""
