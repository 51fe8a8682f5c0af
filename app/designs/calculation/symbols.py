"""Names of formulas as symbols: Greek letters by their names, what stands below after the underscore."""

from __future__ import annotations

_GREEK = {
    "alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "epsilon": "ε", "eta": "η", "theta": "θ", "kappa": "κ",
    "lam": "λ", "mu": "μ", "nu": "ν", "xi": "ξ", "rho": "ρ", "sigma": "σ", "tau": "τ", "phi": "φ", "chi": "χ",
    "psi": "ψ", "omega": "ω", "Delta": "Δ", "Phi": "Φ",
}  # fmt: skip
_BELOW = {"lim": "−1", "plus": "+", "minus": "−"}


def symbol(name: str) -> tuple[str, str]:
    """A name as its letter and what stands below it."""
    letter, _, below = name.partition("_")
    parts = [_BELOW.get(part, _GREEK.get(part, part)) for part in below.split("_") if part]
    return _GREEK.get(letter, letter), ",".join(parts)
