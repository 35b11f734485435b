"""Generic mechanisms of any system of equations: what may act at its inputs, outputs, states and parameters."""
