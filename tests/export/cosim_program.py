"""A unit in libcosim, whose importer is FMI Library: prints its displacement after each of 120 steps of 2 ms."""

from __future__ import annotations

import json
import math
import sys

from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimManipulator import CosimManipulator
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave

DRIVE, DISPLACEMENT = [1], [3]
execution = CosimExecution.from_step_size(step_size=2e6)  # [ns]
index = execution.add_local_slave(
    local_slave=CosimLocalSlave(fmu_path=sys.argv[1], instance_name="oscillator")
)
manipulator, observer = CosimManipulator.create_override(), CosimObserver.create_last_value()
execution.add_manipulator(manipulator)
execution.add_observer(observer)
seen = []
for k in range(120):
    manipulator.slave_real_values(slave_index=index, variable_references=DRIVE, values=[math.sin(0.15 * k)])
    if not execution.step(step_count=1):
        sys.exit(f"step {k} failed")
    seen.append(observer.last_real_values(slave_index=index, variable_references=DISPLACEMENT)[0])
print("\n" + json.dumps(seen))
