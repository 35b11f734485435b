"""The loop's decision as C99 for a microcontroller, translated from the kernels that Python runs: docs/export-c.md."""
