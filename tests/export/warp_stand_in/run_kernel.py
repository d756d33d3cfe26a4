"""Steps a generated module: run_kernel.py MODULE JOINTS < rows of inputs > rows of value, error bar and fault.

The module is in the working folder.

Rows are those of one joint after the other in each tick; a row that begins with "reset" resets the joints whose numbers are not 0.
"""

import importlib
import sys

import numpy as np
import warp as wp

sys.path.insert(0, ".")
module = importlib.import_module(sys.argv[1])
count = int(sys.argv[2])
joints = module.make_state(count)
inputs = wp.zeros((count, len(module.INPUTS)), dtype=module.NUMBER)
filled = 0
for line in sys.stdin:
    if line.startswith("reset"):
        module.reset(joints, wp.array([int(x) for x in line.split()[1:]], dtype=wp.int32))
        continue
    inputs.data[filled] = [float(x) for x in line.split()]
    filled += 1
    if filled == count:
        filled = 0
        module.step(inputs, joints)
        for value, std_dev, fault in zip(joints.value.numpy(), joints.std_dev.numpy(), joints.fault.numpy()):
            print(repr(float(value)), repr(float(std_dev)), fault)
