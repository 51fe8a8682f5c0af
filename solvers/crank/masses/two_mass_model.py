"""Reduction of the crank mechanism's masses to its two pins, and the error of that model.

The rod is replaced by two masses with its mass and its centre of mass; the third condition, an equal moment of
inertia, is violated by the defect Delta J = m_r l_A l_B - J_0.

Source: any text on engine dynamics, e.g. C. F. Taylor, The Internal Combustion Engine in Theory and Practice II.
"""

from __future__ import annotations

from dataclasses import dataclass

from solvers.errors import require, require_not_negative, require_positive


@dataclass(frozen=True)
class RodMass:
    """A rod of length L and mass m_r with its centre of mass at l_A from the wrist pin.

    ``inertia`` is J_0 about the centre of mass [kg m2]; None assumes the two-mass model (no defect).
    """

    length: float
    mass: float
    cg_from_pin: float
    inertia: float | None = None

    def __post_init__(self) -> None:
        require_positive(self, "masses.rod", "length")
        require_not_negative(self, "masses.rod", "mass", "cg_from_pin", "inertia")
        require(
            self.cg_from_pin <= self.length,
            "masses.rod_cg_from_pin",
            "the centre of mass lies outside the rod",
            "between 0 and the rod's length",
        )

    @property
    def at_wrist_pin(self) -> float:
        """m_A = m_r l_B/L [kg]."""
        return self.mass * (self.length - self.cg_from_pin) / self.length

    @property
    def at_crank_pin(self) -> float:
        """m_B = m_r l_A/L [kg]."""
        return self.mass * self.cg_from_pin / self.length

    @property
    def inertia_defect(self) -> float:
        """Delta J = m_r l_A l_B - J_0 [kg m2]; 0 if J_0 is not known."""
        if self.inertia is None:
            return 0.0
        return self.mass * self.cg_from_pin * (self.length - self.cg_from_pin) - self.inertia


@dataclass(frozen=True)
class CrankThrow:
    """Crank pin, two webs of ``web`` each with centre of mass at ``web_radius``, and the throw's counterweights.

    ``counterweight`` is the total mass of the throw's counterweights, opposite to the crank pin.
    """

    crank_pin: float = 0.0
    web: float = 0.0
    web_radius: float = 0.0
    counterweight: float = 0.0
    counterweight_radius: float = 0.0

    def __post_init__(self) -> None:
        require_not_negative(self, "masses", "crank_pin", "web", "web_radius", "counterweight", "counterweight_radius")

    def at_crank_pin(self, crank_radius: float) -> float:
        """m_k, from m_k r = m_cp r + 2 m_w rho_w - m_cw rho_cw [kg]; negative if the counterweights prevail."""
        static = 2.0 * self.web * self.web_radius - self.counterweight * self.counterweight_radius
        return self.crank_pin + static / crank_radius

    def inertia(self, crank_radius: float) -> float:
        """m_cp r^2 + 2 m_w rho_w^2 + m_cw rho_cw^2 [kg m2] about the shaft, with every part as a point mass."""
        return (
            self.crank_pin * crank_radius**2
            + 2.0 * self.web * self.web_radius**2
            + self.counterweight * self.counterweight_radius**2
        )
