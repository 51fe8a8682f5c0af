"""The kernels that Python calls, and their types. Made by scripts/kernel_signatures.py: not to be edited."""

# ruff: noqa: E501

TUPLES: dict[str, str] = {
    "solvers.numerics.panels.Rule": "f1 f1 f2 f2 f1",
    "solvers.numerics.radau.Radau": "f1 f1 f2 f2 f2 f2 f1 f2",
    "solvers.numerics.ripple.Ripple": "f1 c2 c3 c3 f2 f5 f5 f1 f1 f2",
    "solvers.rod.cycle.section.Field": "f1 solvers.numerics.panels.Rule f2 f1 f2 f2 solvers.numerics.ripple.Ripple f2 f2 f f f f b",
    "solvers.rod.cycle.state.Strip": "f f f f f f f f f",
    "solvers.rod.effect_bounds.main_results.Judged": "f1 f2 f1 f f",
    "solvers.rod.effect_bounds.main_results.Judging": "f1 f1 f f f f f f3 f1 f",
    "solvers.rod.load.axial_force.Drive": "f f f f1 f2 f f f f f f",
    "solvers.rod.optimum.peak_model.CorePeaks": "f1 f1 f1 f1 f1 f1 f1 f1 f3 f1 f f1 f f",
    "solvers.rod.optimum.proof.box_bounds.Ranges": "f2 f2 f2 f3 b1",
    "solvers.rod.optimum.proof.box_bounds.Relaxation": "f1 f1 f1 f1 f1 f1 f3 f1 f1 f f1 f1 f f",
    "solvers.rod.optimum.proof.box_bounds.Work": "solvers.rod.optimum.proof.box_bounds.Ranges solvers.rod.optimum.proof.box_bounds.Ranges f2",
    "solvers.rod.strip.elastica_kernels.Collocation": "f1 f2 f2 f1 f1 f1 f1 f1",
    "solvers.rod.vibration.slow_modes.Parts": "f1 f2 f2 f1 f2 f2",
}

ENTRIES: dict[tuple[str, str], tuple[tuple[str, str], ...]] = {
    ("flexible-rod", "design"): (
        ("solvers.fatigue.kernels.severities", "f2 f2 f3 f1 f2"),
        ("solvers.numerics.panels.greatest", "f1 solvers.numerics.panels.Rule f1 f f"),
        ("solvers.numerics.panels.tail_errors", "f2 solvers.numerics.panels.Rule"),
        ("solvers.numerics.panels.values_at", "f1 solvers.numerics.panels.Rule f2 f1"),
        ("solvers.numerics.panels.zeros", "f1 solvers.numerics.panels.Rule f1"),
        ("solvers.rod.cycle.section.peaks", "solvers.rod.cycle.section.Field f3 i i f3 f1 f f b"),
        ("solvers.rod.cycle.section.station_table", "solvers.rod.cycle.section.Field i f"),
        (
            "solvers.rod.cycle.state.axial_force_with_friction",
            "solvers.rod.load.axial_force.Drive solvers.rod.cycle.state.Strip f1",
        ),
        (
            "solvers.rod.cycle.state.fill_states",
            "solvers.rod.load.axial_force.Drive solvers.rod.cycle.state.Strip f1 f2",
        ),
        (
            "solvers.rod.cycle.state.friction_corners",
            "solvers.rod.load.axial_force.Drive solvers.rod.cycle.state.Strip f1",
        ),
        (
            "solvers.rod.effect_bounds.first_order._change_by_motion",
            "solvers.rod.effect_bounds.main_results.Judging solvers.rod.cycle.state.Strip f2 solvers.rod.effect_bounds.main_results.Judged f2 i1 f1 i f f f solvers.rod.strip.elastica_kernels.Collocation",
        ),
        (
            "solvers.rod.effect_bounds.first_order._change_in_large",
            "solvers.rod.effect_bounds.main_results.Judging solvers.rod.cycle.state.Strip f2 solvers.rod.effect_bounds.main_results.Judged solvers.rod.strip.elastica_kernels.Collocation",
        ),
        (
            "solvers.rod.effect_bounds.main_results.changes_without",
            "solvers.rod.effect_bounds.main_results.Judging solvers.rod.load.axial_force.Drive solvers.rod.load.axial_force.Drive solvers.rod.cycle.state.Strip f f solvers.rod.effect_bounds.main_results.Judged",
        ),
        (
            "solvers.rod.effect_bounds.main_results.judge_turn",
            "solvers.rod.effect_bounds.main_results.Judging solvers.rod.load.axial_force.Drive solvers.rod.cycle.state.Strip f2 f",
        ),
        (
            "solvers.rod.effect_bounds.situation._states",
            "solvers.rod.load.axial_force.Drive solvers.rod.cycle.state.Strip f1 i",
        ),
        ("solvers.rod.load.axial_force.axial_forces", "solvers.rod.load.axial_force.Drive f1"),
        ("solvers.rod.load.axial_force.least_force", "solvers.rod.load.axial_force.Drive f1 f1 f"),
        ("solvers.rod.optimum.peak_model.row_slopes", "solvers.rod.optimum.peak_model.CorePeaks f1 f3 f2"),
        ("solvers.rod.optimum.peak_model.rows_at", "solvers.rod.optimum.peak_model.CorePeaks f f f f3 f1"),
        ("solvers.rod.optimum.peak_model.stress_table", "f1 f1 f f f f f f1 f3"),
        (
            "solvers.rod.optimum.proof.branch_and_bound.prove",
            "solvers.rod.optimum.proof.box_bounds.Relaxation f2 f1 f1 f f i solvers.rod.optimum.proof.box_bounds.Work f f1",
        ),
        ("solvers.rod.piston.friction._power", "f1 f1 f1 f f f f"),
        ("solvers.rod.strip.buckling._first_roots", "f1 f1"),
        ("solvers.rod.strip.buckling.first_root", "f"),
        ("solvers.rod.strip.shape.bend", "f1 f1 f1 f1 f f f1 f1 f1"),
        ("solvers.rod.strip.shear.critical_coupling", "f f f"),
        ("solvers.rod.vibration.natural_frequencies._legendre", "f1 i"),
        ("solvers.rod.vibration.natural_frequencies.greatest_ratio", "f2 f2"),
    ),
    ("flexible-rod", "check"): (
        ("solvers.numerics.ripple.parts_at", "solvers.numerics.ripple.Ripple f1"),
        ("solvers.numerics.ripple.reaches", "solvers.numerics.ripple.Ripple f1"),
        (
            "solvers.numerics.ripple_peaks.greatest_with_ripple",
            "f1 solvers.numerics.panels.Rule f1 f f solvers.numerics.ripple.Ripple f1 f2",
        ),
        (
            "solvers.rod.cycle.large_displacement.add_third_order",
            "f2 f f f f f solvers.rod.strip.elastica_kernels.Collocation f2 f2 f1 f1",
        ),
        ("solvers.rod.piston.skirt.contact_load", "f f"),
        ("solvers.rod.vibration.equation._static_shape", "f f f f1"),
        ("solvers.rod.vibration.free_modes.free_mode", "i f1 f2 f1 f2 solvers.numerics.radau.Radau f i"),
        ("solvers.rod.vibration.motion.amplitudes", "f1 f3 solvers.numerics.radau.Radau f1"),
        ("solvers.rod.vibration.slow_modes.carried", "f3 b1"),
        (
            "solvers.rod.vibration.slow_modes.slow_motion",
            "f1 f2 f3 solvers.rod.vibration.slow_modes.Parts solvers.numerics.radau.Radau f i",
        ),
    ),
    ("pin-profile", "design"): (
        ("solvers.pin.bushing.program._densities", "f1 f1 f1 f f f"),
        ("solvers.pin.bushing.section._least_gap", "f2 f f f f f1"),
        ("solvers.pin.cone_bounds.deflection_slopes", "f f f f f f1 f1 f1 f1 f1 f1 f1 f f"),
        ("solvers.pin.cones._greatest_size", "f f1 f1 f1 f1 f1 f f f f"),
        ("solvers.pin.loads._evaluate", "f1 f1 f1 f1 f1 f2 f1 f1 f1"),
        ("solvers.pin.ring._bending", "f"),
        ("solvers.pin.separable._lightest", "f1 f1 f1 f1 f f f i b f1 f1"),
        ("solvers.pin.steps.paths.backward", "f4 f2 f2"),
        ("solvers.pin.steps.paths.costs", "f f2 f2 f f f f4"),
        ("solvers.pin.steps.paths.forward", "f4 f2 f2 i2"),
        ("solvers.pin.walls.demanded", "f1 f1 f f f f f f1 f1"),
        ("solvers.pin.walls.least_walls", "f1 f1 f f f f f f1"),
    ),
    ("impact-linkage", "design"): (
        ("solvers.linkage.envelope.enclosing", "f1"),
        ("solvers.linkage.envelope.extents", "f1 f"),
        ("solvers.linkage.envelope.least_area", "f1 f f f f f f f"),
        ("solvers.linkage.figures.enclosing_radii", "f2"),
        ("solvers.linkage.figures.least_areas", "f2 f1 f1 f1 f f f f f"),
        ("solvers.linkage.figures.least_fits", "f2 f1 f1 f f f"),
        ("solvers.linkage.four_bar.transfer_and_rate", "f2 f1 f1 f2 f2"),
        ("solvers.linkage.loads.unit_peaks", "f2 f1"),
    ),
    ("impact-linkage", "check"): (
        ("solvers.linkage.elasticity.first_peak", "f"),
        ("solvers.linkage.running.inertias", "f1 f f f2 f1"),
        ("solvers.linkage.running.spread", "f1 f f f2 f1 f f f f f1 f1 f2F"),
        ("solvers.linkage.running.turn", "f2 f2 f f f f1 f2F"),
    ),
}
