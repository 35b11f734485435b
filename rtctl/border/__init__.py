"""Types shared by the loop, its drivers and a (simulated) device; nothing else is shared.

`plant_sim` and `drivers` may import this package and nothing more of rtctl (an import contract enforces it).
"""
