"""Compiled kernels under the name by which rtctl knows them; they lie at the border, since drivers have some too."""

from rtctl.border.kernels import FloatArray, IntArray, background_kernel, kernel, uncounted

__all__ = ["FloatArray", "IntArray", "background_kernel", "kernel", "uncounted"]
