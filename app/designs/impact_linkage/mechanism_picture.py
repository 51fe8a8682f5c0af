"""Animated drawing of the mechanism to scale in its swept box.

The animation is SMIL, which works in images without scripts; viewers without support show the links shortly after the
blow.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.designs.impact_linkage.pictures import bar_of
from app.designs.pictures.chart import BLUE, GREEN, GREY, RED, Say, opening
from app.designs.units import figures, quantity, shown_as

Array = NDArray[np.float64]
LINKS = ("base", "crank", "coupler", "rocker")
_WIDE, _HIGH, _MARGIN, _TEXT = 480.0, 380.0, 16.0, 26.0
_FRAMES, _STILL, _SECONDS = 90, 14, 4
_LETTER = 0.56
"""Average width of a letter, at most, relative to the font size."""


def has_size(run: dict[str, Any]) -> bool:
    return run["result"]["lengths_mm"] is not None


class _Place:
    """Mapping from millimetres to the picture, rotated so that the box is upright, y up."""

    def __init__(self, swept: Array, angle: float, pad: float) -> None:
        cos, sin = math.cos(angle), math.sin(angle)
        self._turn = np.array([[cos, sin], [-sin, cos]])
        turned = self._turn @ swept
        self.low, self.high = turned.min(axis=1) - pad, turned.max(axis=1) + pad
        wide, high = self.high - self.low
        self.scale = min((_WIDE - 2 * _MARGIN) / wide, (_HIGH - 2 * _MARGIN - _TEXT) / high)
        self.height = high * self.scale + 2 * _MARGIN + _TEXT
        self._left = 0.5 * (_WIDE - wide * self.scale)

    def __call__(self, points: Array) -> Array:
        x, y = self._turn @ points
        return np.stack([self._left + (x - self.low[0]) * self.scale, _MARGIN + (self.high[1] - y) * self.scale])


def _moves(name: str, values: Array) -> str:
    frames = ";".join(f"{value:.1f}" for value in values)
    return f'<animate attributeName="{name}" values="{frames}" dur="{_SECONDS}s" repeatCount="indefinite"/>'


def _animated(tag: str, at: dict[str, Array], style: str) -> str:
    """An element whose coordinates ``at`` the frames are those given, by name."""
    still = " ".join(f'{name}="{values[min(_STILL, values.size - 1)]:.1f}"' for name, values in at.items())
    moves = "".join(_moves(name, values) for name, values in at.items() if values.size > 1 and np.ptp(values) > 0)
    return f"<{tag} {still} {style}>{moves}</{tag}>"


def _link(ends: tuple[Array, Array], color: str, width: float) -> str:
    """An animated line; ends of shape (2, frames)."""
    at = dict(zip(("x1", "y1", "x2", "y2"), (*ends[0], *ends[1]), strict=True))
    return _animated("line", at, f'stroke="{color}" stroke-width="{width}" stroke-linecap="round"')


def _joint(place: Array, radius: float, style: str) -> str:
    """An animated circle; centre of shape (2, frames)."""
    return _animated("circle", dict(zip(("cx", "cy"), place, strict=True)), f'r="{radius:.1f}" {style}')


def _path(points: Array) -> str:
    path = "L".join(f"{x:.1f},{y:.1f}" for x, y in points.T)
    return f'<path d="M{path}" fill="none" stroke="{GREY}" stroke-opacity="0.6" stroke-dasharray="3 3"/>'


def mechanism_picture(run: dict[str, Any], say: Say = str) -> str:
    """SVG of the mechanism: links, joints with clearance, swept area, box, tool, and blow."""
    result = run["result"]
    pad = run["spec"]["limits"]["joint_radius_mm"] or 0.0
    crank = result["lengths_mm"]["crank"]
    bar = bar_of(result)
    closes, confined = result["closure"]["closes"], result["confined_deg"]
    if not closes:
        pin, joint = standing(result["lengths_mm"])
    else:
        if confined is None:
            phi = np.linspace(0.0, 2.0 * math.pi, _FRAMES + 1)
            phi = np.where(phi > math.pi, phi - 2.0 * math.pi, phi)
            phi[-1] = -1e-12
        else:
            phi = np.radians(0.998 * confined) * np.sin(np.linspace(0.0, 2.0 * math.pi, _FRAMES + 1))
        pin, joint = (crank * points for points in bar.joints(phi))
    round_about = np.linspace(0.0, 2.0 * math.pi, 181)
    circle = crank * np.stack([np.cos(round_about), np.sin(round_about)])
    pivots = np.array([[0.0, crank * float(bar.ratios.base)], [0.0, 0.0]])
    box = result["box_mm"]
    place = _Place(np.hstack([circle, joint, pivots]), math.radians(box["angle_deg"]) if box else 0.0, pad)
    out = [opening(say("The mechanism to scale in its swept box"), _WIDE, place.height)]
    wide, high = (place.high - place.low) * place.scale
    left, top = 0.5 * (_WIDE - wide), _MARGIN
    if box:
        out.append(
            f'<rect x="{left:.1f}" y="{top:.1f}" width="{wide:.1f}" height="{high:.1f}" fill="{GREEN}" '
            f'fill-opacity="0.06" stroke="{GREEN}" stroke-dasharray="8 4"/>'
        )
    out += [_path(place(circle)), _path(place(joint))]
    ground = place(pivots)
    if has_blow := closes and bool(result["transfer"]):
        out.append(_tool(place, joint, pad))
    out.append(_link((ground[:, :1], ground[:, 1:]), "currentColor", 1.5))
    b, c = place(pin), place(joint)
    still = np.repeat(ground[:, :, None], b.shape[1], axis=2)
    out += [_link((b, c), BLUE, 5.0), _link((still[:, 0], b), RED, 5.0), _link((still[:, 1], c), GREEN, 5.0)]
    room = f'fill="{GREY}" fill-opacity="0.12" stroke="{GREY}" stroke-opacity="0.4"'
    for at in (ground[:, :1], ground[:, 1:], b, c):
        out.append(_joint(at, pad * place.scale, room) if pad else "")
        out.append(_joint(at, 4.0, 'fill="#fff" stroke="currentColor" stroke-width="1.5"'))
    if has_blow and confined is None:
        out.append(_flash(c))
    out.append(_words(place.height, result, box, say))
    return "".join(out) + "</svg>"


def standing(lengths: dict[str, float]) -> tuple[Array, Array]:
    """Positions of crank pin and rocker joint for arbitrary lengths, in the middle of the possible range."""
    base, crank, coupler, rocker = (lengths[name] for name in LINKS)
    low, high = max(abs(base - crank), abs(coupler - rocker)), min(base + crank, coupler + rocker)
    apart = 0.5 * (low + high)
    turned = math.acos(min(max((base**2 + crank**2 - apart**2) / (2.0 * base * crank), -1.0), 1.0))
    pin = crank * np.array([math.cos(turned), math.sin(turned)])
    along = (apart**2 + rocker**2 - coupler**2) / (2.0 * apart)
    across = math.sqrt(max(rocker**2 - along**2, 0.0))
    toward = (pin - [base, 0.0]) / apart
    joint = np.array([base, 0.0]) + along * toward + across * np.array([toward[1], -toward[0]])
    return pin[:, None], joint[:, None]


def _tool(place: _Place, joint: Array, pad: float) -> str:
    """The struck tool: a bar across the rocker's path."""
    away = joint[:, 1] - joint[:, 0]
    away /= np.hypot(*away)
    across = np.array([-away[1], away[0]])
    half = 0.06 * float(np.hypot(*(place.high - place.low)))
    at = joint[:, 0] - away * pad
    ends = place(np.stack([at - half * across, at + half * across], axis=1))
    (x1, x2), (y1, y2) = ends
    return f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="currentColor" stroke-width="6"/>'


def _flash(joint: Array) -> str:
    """The blow: an expanding, fading ring."""
    x, y = joint[:, 0]
    timing = f'dur="{_SECONDS}s" repeatCount="indefinite" keyTimes="0;0.15;1"'
    return (
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="6" fill="none" stroke="{RED}" stroke-width="3" opacity="0">'
        f'<animate attributeName="opacity" values="1;0;0" {timing}/>'
        f'<animate attributeName="r" values="6;30;30" {timing}/>'
        "</circle>"
    )


def _words(height: float, result: dict[str, Any], box: dict[str, float] | None, say: Say) -> str:
    lengths = result["lengths_mm"]
    unit, size = shown_as("mm")
    label = ", ".join(f"{say(name)} {figures(lengths[name] / size)}" for name in LINKS) + f" {unit}"
    if box:
        label = say("{} in {} × {}").format(label, figures(box["width"] / size), quantity(box["height"], "mm", 4))
    x, y = 0.5 * _WIDE, height - 9.0
    # As large as fits, because the text is longer in some languages.
    size = min(13.0, (_WIDE - _MARGIN) / (_LETTER * len(label)))
    return (
        f'<text x="{x:.0f}" y="{y:.0f}" text-anchor="middle" font-size="{size:.1f}" fill="currentColor">{label}</text>'
    )
