"""Fatigue criteria on the Haigh plane, and as kernels take them."""

from solvers.fatigue.criteria import (
    CRITERIA,
    FatigueCriterion,
    Gerber,
    HaighLines,
    fkm,
    gerber,
    goodman,
    serensen,
    soderberg,
)

__all__ = [
    "CRITERIA",
    "FatigueCriterion",
    "Gerber",
    "HaighLines",
    "fkm",
    "gerber",
    "goodman",
    "serensen",
    "soderberg",
]
