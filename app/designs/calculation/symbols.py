"""Symbols of names: Greek letters, and subscripts after the underscore."""

from __future__ import annotations

_GREEK = {
    "alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "epsilon": "ε", "eta": "η", "theta": "θ", "kappa": "κ",
    "lam": "λ", "mu": "μ", "nu": "ν", "xi": "ξ", "rho": "ρ", "sigma": "σ", "tau": "τ", "phi": "φ", "chi": "χ",
    "psi": "ψ", "omega": "ω", "Delta": "Δ", "Phi": "Φ",
}  # fmt: skip
_SUBSCRIPTS = {"lim": "−1", "plus": "+", "minus": "−"}


def symbol(name: str) -> tuple[str, str]:
    """Split a name into its letter and subscript."""
    letter, _, below = name.partition("_")
    parts = [_SUBSCRIPTS.get(part, _GREEK.get(part, part)) for part in below.split("_") if part]
    return _GREEK.get(letter, letter), ",".join(parts)
