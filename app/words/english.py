"""English wording of names that do not read well when merely split into words; the catalogues contain the other
languages."""

from __future__ import annotations

_WORDS = {
    "active limits": "limits that are fully used",
    "bore mid": "bore in the middle",
    "boss mean": "boss, mean",
    "boss peak": "boss, peak",
    "brix error": "greatest error of Brix's displacement, of the crank radius",
    "brix pressure error": "greatest error of the pressure by Brix's construction",
    "clamp moment max": "greatest moment at the clamp",
    "constant bore mass": "mass of the best with one diameter",
    "coupler peak": "peak force in the coupler",
    "crank speed jump": "jump of the crank's speed at the blow, relative",
    "enclosing radius": "radius of the enclosing circle",
    "engine.indicated power": "indicated power of all cylinders",
    "equivalent stress max": "greatest equivalent stress",
    "flywheel inertia wanted": "flywheel's moment of inertia needed",
    "force limit": "greatest force that a solid pin carries",
    "free mass": "mass of the lightest of any form",
    "gain still promised": "predicted further improvement",
    "inner side": "inside, at the side",
    "inner top": "inside, under the load",
    "irregularity": "irregularity of the speed",
    "max moment": "greatest bending moment",
    "max ring stress": "hoop stress of the ring",
    "max shear": "greatest shear force",
    "min fatigue safety": "fatigue safety",
    "min link": "shortest link",
    "min stability safety": "safety against buckling",
    "min wall": "wall at its thinnest",
    "min yield safety": "safety against yield",
    "outer mid": "outer diameter in the middle",
    "outer max": "greatest outer diameter",
    "outer side": "outside, at the side",
    "outer top": "outside, under the load",
    "ovalization": "ovalization in the middle",
    "ovalization max": "greatest ovalization",
    "ovalization stress max": "greatest hoop stress of the ring",
    "peak torque": "peak torque on the crank",
    "peak torque at": "crank angle of the peak torque",
    "pin force": "peak pin force",
    "pin force at": "crank angle of the peak pin force",
    "restitution mismatch": "greatest mismatch of the restitution",
    "rod cg from pin": "wrist pin to the rod's centre of mass",
    "rod inertia": "rod's moment of inertia",
    "rod mass": "mass of the rod",
    "rod mass at crank": "rod's mass at the crank pin",
    "rod mass at pin": "rod's mass at the wrist pin",
    "rocker swing": "swing of the rocker",
    "shaft inertia": "shaft's moment of inertia",
    "solid mass": "mass of a solid pin",
    "stability safety": "safety against buckling",
    "strength utilisation": "share of the strength used",
    "stress mean": "mean stress",
    "torque irregularity": "irregularity of the torque",
    "transmission angle": "transmission angle in mid-cycle",
    "two harmonic error": "greatest error of the two-harmonic acceleration, relative",
    "u31 end": "u31 just before the blow",
    "u31 start": "u31 just after the blow",
    "worst fibre": "fibre that governs",
    "worst section": "place of the section that governs",
    "yield safety": "safety against yield",
}
_EXTREMES = {"max": "greatest", "min": "least"}


def in_english(words: str) -> str:
    """The wording of a split name: ``axial force max`` → greatest axial force."""
    known = _WORDS.get(words)
    if known is not None:
        return known
    first, _, rest = words.partition(" ")
    if first in _EXTREMES and rest:
        return f"{_EXTREMES[first]} {rest}"
    rest, _, last = words.rpartition(" ")
    return f"{_EXTREMES[last]} {rest}" if last in _EXTREMES and rest else words
