"""What the properties of the OpenAPI document mean, where their models do not say so themselves.

A name with a unit speaks for itself: its words and its unit are its description. Every other name is in the table, or
in it behind the name of its schema.
"""

from __future__ import annotations

from typing import Any

from app.designs.units import split_unit

_SAID = {
    "accuracy": "wanted, estimated, and whether it was met; null where nothing was solved",
    "active": "whether the effect ran in the request itself",
    "active_constraints": "requirements and bounds that shape the design, with what they are worth",
    "active_limits": "names of the limits that are used up",
    "advice": "what would have to change",
    "against": "the quantity that the objective is traded against",
    "against_unit": "unit of the other quantity",
    "allowed": "what would be accepted",
    "alternatives": "the best linkage of every allowed type, or why it has none",
    "b": "width of the strip",
    "base": "length of the base, crank pivot to rocker pivot",
    "batch_id": "the batch that the run belongs to; null: none",
    "boss_mean": "mean over a boss",
    "boss_peak": "greatest, at the boss's inner edge",
    "bounds": "least and greatest dimensions",
    "buckles_sideways": "whether the strip is thinner across the crank's plane than in it, and buckles that way",
    "cached": "whether it was answered from an earlier run of the same request by the same solver",
    "certificate": "how the answer is known to be the best, or that there is none; null: it is not",
    "choices": "the words that the field takes; null: any",
    "closes": "whether the four links come to lie on one line",
    "closure": "how well the lengths close",
    "cost": "what it costs",
    "coupler": "length of the coupler",
    "crank": "length of the crank",
    "created_at": "when the run was asked for, UTC",
    "criteria": "every requirement, limit and criterion of strength",
    "cycle": "the pressures as used, over one cycle",
    "cylinder": "bore, clearance, crankcase and strokes",
    "cylinders": "number of cylinders",
    "dead_centre_jumps": "where the pressure jumps",
    "deflection_ratio": "greatest deflection over the free length; null: no shape",
    "detail": "what is wrong",
    "diagnosis": "which requirements cannot be met, how far the best is from them, and what would help",
    "dimensions": "width, thickness and free length of the strip",
    "doing": "what is done just now",
    "drive": "the motor and what it turns; null: the crank turns evenly",
    "effect_costs": "what each effect changes and costs in this case",
    "effects": "every effect with its state and its bound",
    "engine": "several cylinders on one shaft; null: one",
    "errors": "one entry for every bad field",
    "estimated": "estimated relative error of the results",
    "evidence": "the figures behind the proof, by name",
    "example": "a request that works",
    "exclude": "names of effects that must not run",
    "exclusive_maximum": "values lie below it; null: no such bound",
    "exclusive_minimum": "values lie above it; null: no such bound",
    "exports": "what the run offers to take away, by name",
    "extension": "ending of the file's name",
    "fatigue_criterion": "the convention of the fatigue safety",
    "fatigue_safety": "against fatigue, by the convention named; null: nothing alternates, or no stresses exist",
    "fields": "every field of the request",
    "form": "the form that was sought",
    "friction_coefficient": "between piston and cylinder",
    "front": "what the objective costs in another quantity; null: not asked for",
    "gap": "how far the point may be from the best, relative",
    "geometry": "diameters and lengths",
    "height": "its other side",
    "help": "what the field means",
    "high": "greatest value of the range",
    "holds": "whether the part holds: true only if every criterion does",
    "id": "the run's own name, for its address",
    "include": "names of effects that must run",
    "inner_side": "at the inner fibre, in the mean plane",
    "inner_top": "at the inner fibre, under the load",
    "items": "the entries",
    "kind": "which of its forms this is, or the kind of design",
    "kinematic_restitution": "the restitution for which the crank feels no jolt, R_k; null: it cannot strike",
    "l": "free length of the strip",
    "label": "the name in words",
    "lambda0": "base over crank",
    "lambda2": "coupler over crank",
    "lambda3": "rocker over crank",
    "least_items": "least number of entries; null: no such bound",
    "lengths_mm": "the four links, in mm; null: only ratios were given",
    "levels": "settings from loose to tight, with their errors and times",
    "limits": "what must be kept besides",
    "links": "where the run and what belongs to it are found",
    "load": "what acts on the part",
    "low": "least value of the range",
    "masses": "piston, rod and crank",
    "material": "strengths, stiffness and density, or a name of the catalogue",
    "maximum": "greatest value; null: no such bound",
    "measure": "how its influence is measured beforehand",
    "mechanism": "crank, rod and speed",
    "media_type": "of the file",
    "method": "how the masses are found",
    "minimum": "least value; null: no such bound",
    "mode": "what is asked: design, check, analysis or accuracy",
    "modes": "what can be asked of the kind",
    "name": "its name",
    "next_cursor": "asks for the next page; null: this is the last",
    "nullable": "whether null is a value",
    "objective": "what a design makes least or greatest, or its value at this point",
    "objective_unit": "unit of the objective",
    "order": "of the harmonic, in turns of the crank",
    "outer_side": "at the outer fibre, in the mean plane",
    "outer_top": "at the outer fibre, under the load",
    "page": "the run for people",
    "piston": "diameter, skirt, mass and friction",
    "plots": "pictures by name",
    "pointer": "JSON pointer of the field (RFC 6901)",
    "points": "the points, or how many of them",
    "poisson": "Poisson's ratio",
    "pressure": "what drives it",
    "problem": "why there is no answer (RFC 9457); null: there is one",
    "profile": "the part along its axis",
    "ratios": "links over crank",
    "reason": "why the type has none; empty where it has one",
    "reciprocating_unbalance": "forces and couples of the moving masses, by order",
    "repairs": "what was done to the points; empty unless asked for",
    "requested": "relative accuracy asked for",
    "requests": "what can be sent, by mode",
    "required": "what is asked for",
    "requirement": "name of the field or limit",
    "requirements": "least safeties and greatest loads",
    "result": "what was found, or the diagnosis; null: nothing yet, or the run failed",
    "ring_model": "by which model the ring is judged; null: the effect did not run",
    "rocker": "length of the rocker",
    "rotatable": "whether the crank turns fully",
    "runs": "how often it was timed",
    "self": "the run as JSON",
    "series": "forces over the crank angle",
    "settings": "numerical settings by name",
    "slope_to": "slope at its end",
    "small_end": "mean in the rod's small end",
    "solver": "who solved",
    "spec": "the request as understood, defaults filled in",
    "spec_hash": "SHA-256 of kind, mode and request, the name apart",
    "stability_safety": "critical force over the greatest compression; null: nothing presses",
    "state": "active or skipped",
    "status": "how the solve stands or ended",
    "step_mm": "steps to whose multiples the dimensions are rounded, in mm",
    "strength_utilisation": "greatest share of the allowable stress; null: load where there is no wall",
    "strokes": "strokes of a cycle",
    "summary": "what it is",
    "timing": "seconds by what took them",
    "title": "what it is, in words",
    "tolerance_window": "what lengths off by their tolerance do about the blow",
    "transfer": "u31 over the crank angle",
    "type": "which of the change-point linkages, or a URI of the kind of problem",
    "u31": "speed of the rocker over that of the crank",
    "uncertainty": "standard uncertainties of what was measured",
    "unit": "its unit; empty: none",
    "value": "its value",
    "value_unit": "unit of the value",
    "version": "of the solver",
    "warnings": "what to know beside the results",
    "what": "what was done",
    "why": "why it ran or did not",
    "width": "one side of the box",
    "worst": "instants at which a load is greatest",
    "worst_fibre": "side of the strip that governs: 1 at +h/2, -1 at -h/2",
    "yield_safety": "yield strength over the greatest stress; null: no stresses exist",
    "MaterialInfo.name": "its name in the catalogue",
    "ProblemDetails.status": "HTTP status",
    "ProblemDetails.type": "URI of the kind of problem; about:blank: the status says it",
    "ProblemDetails.title": "the kind of problem in words",
    "EffectResult.name": "name of the effect",
    "Solver.name": "name of the program",
    "Figure.name": "name of the number, as in the result",
}


def meaning(schema: str, name: str) -> str | None:
    """What a property means; None for a name that neither has a unit nor is in the table."""
    said = _SAID.get(f"{schema}.{name}") or _SAID.get(name)
    if said:
        return said
    plain = name.removesuffix("_u")
    words, unit = split_unit(plain)
    if not unit:
        return None
    uncertain = "standard uncertainty of the " if plain != name else ""
    return f"{uncertain}{words}, in {unit}"


def describe(schemas: dict[str, Any]) -> None:
    """Title every schema by its own name, which generators take, and write into every property that does not describe
    itself what it means."""
    for schema, content in schemas.items():
        content["title"] = schema
        for name, part in content.get("properties", {}).items():
            said = meaning(schema, name)
            if not part.get("description") and said:
                # Beside a reference a description counts since OpenAPI 3.1.
                part["description"] = said
