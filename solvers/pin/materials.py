"""Catalogue of piston pin steels, each value with its source."""

from __future__ import annotations

from dataclasses import dataclass

from solvers.materials import Catalogued, sources_of
from solvers.pin.scene import PinMaterial


@dataclass(frozen=True)
class PinSteel(PinMaterial, Catalogued):
    """A pin steel of the catalogue."""


_ALLOWED = "assumed, within the 100 to 250 MPa that A. Kolchin and V. Demidov (Design of Automotive Engines) allow: "


def _steel(title: str, allowable: float, source_note: str) -> PinSteel:
    return PinSteel(
        allowable, 210e9, 0.3, 7850.0, title=title,
        sources=sources_of(
            allowable_stress=_ALLOWED + source_note,
            elastic_modulus="typical of carbon and low-alloy steels at room temperature",
            poisson="typical of steel",
            density="typical of low-alloy steels",
        ),
    )  # fmt: skip


CATALOGUE: dict[str, PinSteel] = {
    "pin-steel-17Cr3": _steel(
        "Case-hardening steel 17Cr3, 1.7016, case-hardened", 150e6, "that of the paper's example"
    ),
    "pin-steel-16MnCr5": _steel("Case-hardening steel 16MnCr5, 1.7131, case-hardened", 180e6, "about its middle"),
    "pin-steel-31CrMoV9": _steel("Nitriding steel 31CrMoV9, 1.8519, nitrided", 220e6, "its upper part"),
}
"""Case-hardened and nitrided steels as named by piston pin standards (DIN 73126, ISO 18669-1).

For orientation only, not for release of a part: the allowable stress is a design convention, not a property of the
steel; override it with a value of your own. The other values are those of steel in general.
"""
