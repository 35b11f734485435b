"""Integration of equations: explicit and implicit steps over many lanes, inputs between samples, the step."""
