"""Reasons not to use a value (docs/robot/estimator.md)."""

from enum import IntEnum


class Fault(IntEnum):
    """What a step reports about its own output; `none` is 0, so that `if estimate.fault:` finds all others."""

    none = 0
    input_not_finite = 1
    input_count_wrong = 2
    warming_up = 3
    zero_not_set = 4
    outside_training_range = 5
    recovering = 6
    wrong_rate = 7
    model_not_finite = 8
    diverged = 9
