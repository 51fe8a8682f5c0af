"""Requests and answers, as the service describes them. Made by scripts/client_types.py: not to be edited."""

from __future__ import annotations

from typing import Any, Literal, Union

from typing_extensions import NotRequired, TypedDict


class AccuracyResult(TypedDict):
    """What was asked for, the estimate of what was reached, and the settings that did it."""

    requested: float
    estimated: float
    met: bool
    """whether estimated is at most requested"""
    settings: dict[str, float | int | str]


class Active(TypedDict):
    name: str
    """a requirement, or a bound such as b_upper"""
    sensitivity: float
    """relative change of the objective for a relative change of the bound"""


class AlternativeResult(TypedDict):
    """The best linkage of a type, or why the type has none."""

    type: str
    value: float | None
    """of the objective, in the unit of the certificate"""
    lengths_mm: Lengths | None
    ratios: Ratios | None
    reason: str


class Batch(TypedDict):
    """Many requests of one kind and mode as one job; each of its items is a run."""

    id: str
    kind: str
    mode: Mode
    name: str
    detail: Detail
    status: Literal["queued", "running", "ended", "cancelled"]
    created_at: str
    ended_at: str | None
    items: BatchItems
    rate_per_s: float | None
    """items a second since the first was begun"""
    remaining_s: float | None
    """null: nothing is known yet"""
    solver: Solver
    links: BatchLinks


class BatchItems(TypedDict):
    """How many items there are, and how those that are done ended."""

    total: int
    done: int
    succeeded: int
    infeasible: int
    failed: int
    refused: int
    """rows that are no valid request"""
    cancelled: int


class BatchLinks(TypedDict):
    """Where a batch and what belongs to it are found."""

    self: str
    page: str
    results: str
    events: str
    runs: str


class BatchPage(TypedDict):
    """A page of the list of batches; ``next_cursor`` asks for the next one."""

    items: list[Batch]
    next_cursor: str | None

BatchStatus = Literal["receiving", "queued", "running", "ended", "cancelled"]


class BoreForm(TypedDict):
    """The shapes that the bore may have."""

    kind: NotRequired[Literal["free", "drillable", "constant", "stepped", "double_cone", "cone_cylinder"]]
    steps: NotRequired[float | None]
    """bores from each end to the middle; stepped only"""


class CatalogueMaterial(TypedDict):
    name: Literal["paper-strip", "spring-steel-1.1274", "stainless-1.4310"]
    """a name of the catalogue"""


class CertificateResult(TypedDict):
    """How a design is known to be the best there is: what is proven, of what, by which argument, and what is not."""

    method: str
    """by which argument"""
    bound: float | None
    """no feasible design is better, in the objective's unit; null: none exists"""
    gap: float | None
    """relative distance of the answer, as it is told, from the bound; null: no bound is known"""
    evidence: dict[str, float | int | str]
    proven: str
    """what is proven"""
    physics: str
    """for which physics"""
    form: str
    """for which designs"""
    range: str
    """over which range of them"""
    estimated: list[str]
    """what is only estimated, and where it is told"""


class ClosureResult(TypedDict):
    """How well the lengths close; the surplus is 0 for a change-point mechanism."""

    surplus_mm: float
    relative: float
    """surplus over the longest link"""
    closes: bool


class ConstantLoad(TypedDict):
    """One pressure at all angles, as a press or a test bench applies it."""

    kind: Literal["constant"]
    constant_pressure_mpa: float
    back_pressure_mpa: NotRequired[float | None]
    """null: none"""


class Corner(TypedDict):
    x_mm: float
    bore_mm: float
    outer_diameter_mm: float


class CrankDynamicsAccuracyRun(TypedDict):
    """A run: whether the part holds, what was asked for, what came out, which effects were computed, how accurate it
    is and what it took. ``status`` says only how the solve ended."""

    id: str
    kind: str
    mode: Mode
    status: RunStatus
    name: str
    created_at: str
    spec_hash: str
    cached: bool
    batch_id: str | None
    holds: bool | None
    """the verdict's own; null: there is no verdict"""
    figure: Figure | None
    """null: there is no result, or the run is of before figures"""
    solver: Solver
    verdict: VerdictResult | None
    """of every design and check that has an answer; null of all others, and of runs of before verdicts"""
    spec: CrankDynamicsStudyRequest
    result: StudyResult | Infeasible | None
    problem: ProblemDetails | None
    effects: list[EffectResult]
    accuracy: AccuracyResult | None
    timing: dict[str, float]
    links: Links
    progress: RunProgress | None
    """of a run under way, where it is a long one"""


class CrankDynamicsAnalysisRun(TypedDict):
    """A run: whether the part holds, what was asked for, what came out, which effects were computed, how accurate it
    is and what it took. ``status`` says only how the solve ended."""

    id: str
    kind: str
    mode: Mode
    status: RunStatus
    name: str
    created_at: str
    spec_hash: str
    cached: bool
    batch_id: str | None
    holds: bool | None
    """the verdict's own; null: there is no verdict"""
    figure: Figure | None
    """null: there is no result, or the run is of before figures"""
    solver: Solver
    verdict: VerdictResult | None
    """of every design and check that has an answer; null of all others, and of runs of before verdicts"""
    spec: DynamicsRequest
    result: DynamicsResult | Infeasible | None
    problem: ProblemDetails | None
    effects: list[EffectResult]
    accuracy: AccuracyResult | None
    timing: dict[str, float]
    links: Links
    progress: RunProgress | None
    """of a run under way, where it is a long one"""


class CrankDynamicsMechanism(TypedDict):
    crank_radius_mm: float
    """r, crank radius; less than the rod's length"""
    rod_length_mm: float
    """L, wrist pin to crank pin"""
    speed_hz: float
    """revolutions per second"""
    offset_mm: NotRequired[float]
    """cylinder axis beside the shaft, positive toward the side to which the crank turns from the top; angles then
    count from the crank standing parallel to the cylinder axis"""


class CrankDynamicsStudyRequest(TypedDict):
    """The case, what is wanted of a solution, and how long the levels may be timed."""

    time_budget_s: NotRequired[float | None]
    """what one solution may take; null: the spec's accuracy decides what is recommended"""
    study_budget_s: NotRequired[float]
    """time of the independent reference and of the runs, the tightest solution not counted; an independent reference
    that takes too long is given up, rungs that the time does not reach are left out"""
    spec: DynamicsRequest
    """a request of this kind"""


class CrankMassesAnalysisRun(TypedDict):
    """A run: whether the part holds, what was asked for, what came out, which effects were computed, how accurate it
    is and what it took. ``status`` says only how the solve ended."""

    id: str
    kind: str
    mode: Mode
    status: RunStatus
    name: str
    created_at: str
    spec_hash: str
    cached: bool
    batch_id: str | None
    holds: bool | None
    """the verdict's own; null: there is no verdict"""
    figure: Figure | None
    """null: there is no result, or the run is of before figures"""
    solver: Solver
    verdict: VerdictResult | None
    """of every design and check that has an answer; null of all others, and of runs of before verdicts"""
    spec: MassesRequest
    result: MassesResult | Infeasible | None
    problem: ProblemDetails | None
    effects: list[EffectResult]
    accuracy: AccuracyResult | None
    timing: dict[str, float]
    links: Links
    progress: RunProgress | None
    """of a run under way, where it is a long one"""


class CriterionResult(TypedDict):
    """One figure and what is required of it."""

    name: str
    """of the request's field where asked is true, else of the result"""
    label: str
    """the same in words"""
    sense: Literal["at_least", "at_most", "equal", "yes"]
    """how reached must stand to required; yes: 1 for yes, 0 for no"""
    required: float
    reached: float | None
    """null: nothing acts, or where it does not hold, nothing is known or it has no bound"""
    unit: str
    margin: float | None
    """how many times more it could bear, less 1: reached/required - 1 of a least value, required/reached - 1 of a
    greatest one; 0: all of it is used; negative where it does not hold; null where nothing acts or nothing is
    known"""
    holds: bool
    """within the accuracy asked for, at most 1e-3, of what is required"""
    asked: bool
    """whether the request asks for it, or every such part must keep it"""


class CustomMaterial(TypedDict):
    elastic_modulus_gpa: float
    fatigue_limit_mpa: float
    """alternating bending of a smooth specimen"""
    fatigue_reduction: float
    """K: notch, size and surface together"""
    mean_stress_sensitivity: float
    """psi"""
    yield_strength_mpa: float
    density_kg_m3: float
    poisson: NotRequired[float]
    ultimate_strength_mpa: NotRequired[float | None]
    """for Goodman and Gerber"""


class CyclePoints(TypedDict):
    """The pressures as used: what a rod design takes when it names this run as its load."""

    strokes: int
    angle_deg: list[float]
    pressure_mpa: list[float]
    crankcase_pressure_mpa: float


class Cylinder(TypedDict):
    bore_mm: float
    clearance_volume_cm3: NotRequired[float]
    """volume at the upper dead centre"""
    crankcase_pressure_mpa: NotRequired[float]
    """pressure under the piston"""
    strokes: Literal[2, 4]
    """strokes of a cycle"""

Detail = Literal["scalars", "full"]


class Dimensions(TypedDict):
    b_mm: float
    """width"""
    h_mm: float
    """thickness; the strip bends about it"""
    l_mm: float
    """free length; at most the rod's length"""


class Drive(TypedDict):
    """A motor with a linear torque-speed line, and the inertia it turns; calls up the effect impact_dynamics."""

    stall_torque_nm: NotRequired[float | None]
    """torque of the motor, at the crank, standing"""
    free_speed_hz: NotRequired[float | None]
    """turns per second without load, at the crank"""
    crank_inertia_kg_m2: NotRequired[float | None]
    """crank and flywheel together"""


class DynamicsRequest(TypedDict):
    """A crank mechanism, its masses, and the pressure that drives it."""

    name: NotRequired[str]
    """a name for people; it changes no result"""
    effects: NotRequired[Literal["auto", "all"] | EffectChoice]
    """auto, all, or a choice with include and exclude"""
    effect_tolerance: NotRequired[float]
    """what all effects left out may change together, relative"""
    accuracy: NotRequired[float]
    """wanted relative numerical accuracy"""
    mechanism: CrankDynamicsMechanism
    cylinder: Cylinder
    pressure: TablePressure | IndicatorPressure
    masses: Masses
    engine: NotRequired[Engine | None]
    series_angles: NotRequired[int]
    """equally spaced angles of the series"""


class DynamicsResult(TypedDict):
    """Forces over the cycle; torque and power at the top are those of one cylinder, irregularity that of the shaft."""

    reciprocating_mass_kg: float
    rotating_mass_kg: float
    rod_mass_at_pin_kg: float
    rod_mass_at_crank_kg: float
    inertia_defect_kg_m2: float
    mean_torque_nm: float
    indicated_power_w: float
    irregularity: float | None
    """(greatest - least speed)/mean for the inertia there is; null: none"""
    torque_irregularity: float | None
    """(greatest - least torque)/mean torque; null: no mean torque"""
    work_fluctuation_j: float
    """work between the extremes of the speed"""
    shaft_inertia_kg_m2: float
    flywheel_inertia_wanted_kg_m2: float | None
    """null: no irregularity was asked for"""
    brix_error: float
    """greatest error of Brix's displacement, relative to the crank radius"""
    two_harmonic_error: float
    """greatest error of the two-harmonic acceleration, of its greatest"""
    brix_pressure_error_mpa: float | None
    gas_force_max_n: float
    rod_compression_max_n: float
    rod_tension_max_n: float
    """negative where the rod is never in tension"""
    side_force_max_n: float
    wrist_pin_load_max_n: float
    crank_pin_load_max_n: float
    main_bearing_load_max_n: float
    stroke_mm: float
    upper_dead_centre_deg: float
    lower_dead_centre_deg: float
    worst: list[WorstInstant]
    engine: EngineResult | None
    dead_centre_jumps: list[Jump]
    repairs: list[RepairDone]
    cycle: CyclePoints
    series: Series
    warnings: list[str]


class EffectChoice(TypedDict):
    """Effects that the user settles; all others follow their bounds."""

    include: NotRequired[list[str]]
    exclude: NotRequired[list[str]]


class EffectCostResult(TypedDict):
    """What one effect changes and costs here; null where there is no answer without it, or the time was over."""

    name: str
    active: bool
    change: float | None
    """greatest relative change of the main results between with and without"""
    brings: list[str]
    """main results that exist only with it"""
    time_with_s: float | None
    time_without_s: float | None
    runs: int


class EffectResult(TypedDict):
    """One line of the effects manifest."""

    name: str
    state: Literal["active", "skipped"]
    influence: float
    """bound on the relative change of the main results; 1e9 stands for unbounded"""
    why: str


class Engine(TypedDict):
    """Several like cylinders on one shaft."""

    cylinders: int
    phases_deg: list[float]
    """crank angle by which each cylinder's cycle follows the first one's"""
    bank_deg: NotRequired[float | list[float]]
    """angle of the V, cylinders by turns left and right; or every cylinder's own direction"""
    positions_mm: NotRequired[list[float] | None]
    """along the shaft; null: no couples are wanted"""
    flywheel_inertia_kg_m2: NotRequired[float]
    wanted_irregularity: NotRequired[float | None]
    """(greatest - least speed)/mean speed; gives the flywheel for it"""


class EngineResult(TypedDict):
    """All cylinders together."""

    mean_torque_nm: float
    torque_max_nm: float
    torque_min_nm: float
    indicated_power_w: float
    reciprocating_unbalance: list[Unbalance]
    rotating_unbalance_n: float
    rotating_couple_nm: float | None
    shared_crank_pin_load_max_n: float | None
    shared_main_bearing_load_max_n: float | None


class EstimateRequest(TypedDict):
    """Constructive masses of an existing engine, scaled to a bore."""

    name: NotRequired[str]
    """a name for people; it changes no result"""
    effects: NotRequired[Literal["auto", "all"] | EffectChoice]
    """auto, all, or a choice with include and exclude"""
    effect_tolerance: NotRequired[float]
    """what all effects left out may change together, relative"""
    accuracy: NotRequired[float]
    """wanted relative numerical accuracy"""
    method: Literal["estimate"]
    bore_mm: float
    piston_kg_m2: float
    """piston group per piston area"""
    rod_kg_m2: float
    """rod per piston area"""
    uncertainty: NotRequired[EstimateUncertainty]


class EstimateUncertainty(TypedDict):
    """Standard uncertainties of what was assumed."""

    bore_mm: NotRequired[float]
    piston_kg_m2: NotRequired[float]
    rod_kg_m2: NotRequired[float]


class Figure(TypedDict):
    """The number that matters most of a run: what a design was after, a part's mass, an engine's power."""

    name: str
    value: float


class FlexibleRodAccuracyRun(TypedDict):
    """A run: whether the part holds, what was asked for, what came out, which effects were computed, how accurate it
    is and what it took. ``status`` says only how the solve ended."""

    id: str
    kind: str
    mode: Mode
    status: RunStatus
    name: str
    created_at: str
    spec_hash: str
    cached: bool
    batch_id: str | None
    holds: bool | None
    """the verdict's own; null: there is no verdict"""
    figure: Figure | None
    """null: there is no result, or the run is of before figures"""
    solver: Solver
    verdict: VerdictResult | None
    """of every design and check that has an answer; null of all others, and of runs of before verdicts"""
    spec: FlexibleRodStudyRequest
    result: StudyResult | Infeasible | None
    problem: ProblemDetails | None
    effects: list[EffectResult]
    accuracy: AccuracyResult | None
    timing: dict[str, float]
    links: Links
    progress: RunProgress | None
    """of a run under way, where it is a long one"""


class FlexibleRodCheckRequest(TypedDict):
    """A strip of given dimensions in its machine."""

    name: NotRequired[str]
    """a name for people; it changes no result"""
    effects: NotRequired[Literal["auto", "all"] | EffectChoice]
    """auto, all, or a choice with include and exclude"""
    effect_tolerance: NotRequired[float]
    """what all effects left out may change together, relative"""
    accuracy: NotRequired[float]
    """wanted relative numerical accuracy"""
    mechanism: FlexibleRodMechanism
    piston: Piston
    load: SchmidtLoad | TableLoad | ConstantLoad | IndicatorLoad | RunLoad
    material: CustomMaterial | CatalogueMaterial
    fatigue_criterion: NotRequired[Literal["serensen", "goodman", "gerber", "soderberg", "fkm"]]
    """the convention of the fatigue safety"""
    dimensions: Dimensions


class FlexibleRodCheckRun(TypedDict):
    """A run: whether the part holds, what was asked for, what came out, which effects were computed, how accurate it
    is and what it took. ``status`` says only how the solve ended."""

    id: str
    kind: str
    mode: Mode
    status: RunStatus
    name: str
    created_at: str
    spec_hash: str
    cached: bool
    batch_id: str | None
    holds: bool | None
    """the verdict's own; null: there is no verdict"""
    figure: Figure | None
    """null: there is no result, or the run is of before figures"""
    solver: Solver
    verdict: VerdictResult | None
    """of every design and check that has an answer; null of all others, and of runs of before verdicts"""
    spec: FlexibleRodCheckRequest
    result: RodResult | Infeasible | None
    problem: ProblemDetails | None
    effects: list[EffectResult]
    accuracy: AccuracyResult | None
    timing: dict[str, float]
    links: Links
    progress: RunProgress | None
    """of a run under way, where it is a long one"""


class FlexibleRodDesignRequest(TypedDict):
    """The best strip for a machine: requirements, bounds, and what is wanted."""

    time_budget_s: NotRequired[float | None]
    """wall-clock time that this design may take, at most the service's own limit; null: that limit. A kind that
    finds better and better designs answers with the best that meets every requirement, with the gap that is left
    and accuracy.met false; any other run that does not end in time fails"""
    name: NotRequired[str]
    """a name for people; it changes no result"""
    effects: NotRequired[Literal["auto", "all"] | EffectChoice]
    """auto, all, or a choice with include and exclude"""
    effect_tolerance: NotRequired[float]
    """what all effects left out may change together, relative"""
    accuracy: NotRequired[float]
    """wanted relative numerical accuracy"""
    mechanism: FlexibleRodMechanism
    piston: Piston
    load: SchmidtLoad | TableLoad | ConstantLoad | IndicatorLoad | RunLoad
    material: CustomMaterial | CatalogueMaterial
    fatigue_criterion: NotRequired[Literal["serensen", "goodman", "gerber", "soderberg", "fkm"]]
    """the convention of the fatigue safety"""
    requirements: NotRequired[Requirements]
    bounds: RodBounds
    stock_h_mm: NotRequired[list[float] | None]
    """the thicknesses to be had; null: any"""
    step_mm: NotRequired[Steps]
    objective: NotRequired[Literal["mass", "friction_power", "contact_pressure", "side_force", "fatigue_safety", "stability_safety"]]


class FlexibleRodDesignResult(TypedDict):
    """The strip found, the constraints that shape it, and how it is known to be the best."""

    dimensions: Dimensions
    fatigue_safety: float | None
    stability_safety: float | None
    yield_safety: float | None
    critical_force_n: float
    buckles_sideways: bool
    axial_force_min_n: float
    axial_force_max_n: float
    stress_amplitude_mpa: float | None
    stress_mean_mpa: float | None
    worst_section_mm: float | None
    worst_fibre: int | None
    side_force_max_n: float | None
    clamp_moment_max_nmm: float | None
    contact_pressure_max_mpa: float | None
    friction_power_w: float | None
    deflection_ratio: float | None
    natural_frequency_hz: float
    mass_g: float
    fatigue_criterion: str
    repairs: list[RepairDone]
    """what was done to the load's points; empty unless asked for"""
    warnings: list[str]
    objective: str
    active_constraints: list[Active]
    certificate: CertificateResult | None


class FlexibleRodDesignRun(TypedDict):
    """A run: whether the part holds, what was asked for, what came out, which effects were computed, how accurate it
    is and what it took. ``status`` says only how the solve ended."""

    id: str
    kind: str
    mode: Mode
    status: RunStatus
    name: str
    created_at: str
    spec_hash: str
    cached: bool
    batch_id: str | None
    holds: bool | None
    """the verdict's own; null: there is no verdict"""
    figure: Figure | None
    """null: there is no result, or the run is of before figures"""
    solver: Solver
    verdict: VerdictResult | None
    """of every design and check that has an answer; null of all others, and of runs of before verdicts"""
    spec: FlexibleRodDesignRequest
    result: FlexibleRodDesignResult | Infeasible | None
    problem: ProblemDetails | None
    effects: list[EffectResult]
    accuracy: AccuracyResult | None
    timing: dict[str, float]
    links: Links
    progress: RunProgress | None
    """of a run under way, where it is a long one"""


class FlexibleRodMechanism(TypedDict):
    crank_radius_mm: float
    """r, crank radius; less than the rod's length"""
    rod_length_mm: float
    """L, clamp in the piston to crank pin"""
    speed_hz: float
    """revolutions per second"""


class FlexibleRodStudyRequest(TypedDict):
    """The case, what is wanted of a solution, and how long the levels may be timed."""

    time_budget_s: NotRequired[float | None]
    """what one solution may take; null: the spec's accuracy decides what is recommended"""
    study_budget_s: NotRequired[float]
    """time of the independent reference and of the runs, the tightest solution not counted; an independent reference
    that takes too long is given up, rungs that the time does not reach are left out"""
    spec: FlexibleRodDesignRequest | FlexibleRodCheckRequest
    """a design request or a check request of this kind"""

Format = Literal["ndjson", "csv", "parquet"]


class FrontPointResult(TypedDict):
    """A linkage of the front: none is better in both quantities, up to the gap."""

    objective: float
    against: float
    gap: float
    type: str
    lengths_mm: Lengths
    box_area_mm2: float
    longest_link_mm: float
    enclosing_radius_mm: float
    peak_torque_nm: float | None
    pin_force_n: float | None


class FrontRequest(TypedDict):
    """A Pareto front: the best objective for limits on another quantity, from its least value up."""

    against: NotRequired[Literal["none", "longest_link", "enclosing_radius", "pin_force"]]
    """the other quantity"""
    points: NotRequired[float]


class FrontResult(TypedDict):
    """What the objective costs in another quantity, by rising values of that quantity."""

    objective: str
    objective_unit: str
    against: str
    against_unit: str
    points: list[FrontPointResult]


class Geometry(TypedDict):
    outer_diameter_mm: NotRequired[float | None]
    """D; a bushing's design finds it and does without"""
    boss_length_mm: float
    """a, the length in each boss of the piston"""
    small_end_length_mm: float
    """b, the length in the rod's small end"""
    gap_mm: NotRequired[float]
    """between small end and boss"""


class ImpactLinkageAccuracyRun(TypedDict):
    """A run: whether the part holds, what was asked for, what came out, which effects were computed, how accurate it
    is and what it took. ``status`` says only how the solve ended."""

    id: str
    kind: str
    mode: Mode
    status: RunStatus
    name: str
    created_at: str
    spec_hash: str
    cached: bool
    batch_id: str | None
    holds: bool | None
    """the verdict's own; null: there is no verdict"""
    figure: Figure | None
    """null: there is no result, or the run is of before figures"""
    solver: Solver
    verdict: VerdictResult | None
    """of every design and check that has an answer; null of all others, and of runs of before verdicts"""
    spec: ImpactLinkageStudyRequest
    result: StudyResult | Infeasible | None
    problem: ProblemDetails | None
    effects: list[EffectResult]
    accuracy: AccuracyResult | None
    timing: dict[str, float]
    links: Links
    progress: RunProgress | None
    """of a run under way, where it is a long one"""


class ImpactLinkageCheckRequest(TypedDict):
    """A linkage given by its type and free ratio, then with R_k = R, or by its four lengths. Results that a
    frequency, a speed or an energy would be needed for are null without them."""

    name: NotRequired[str]
    """a name for people; it changes no result"""
    effects: NotRequired[Literal["auto", "all"] | EffectChoice]
    """auto, all, or a choice with include and exclude"""
    effect_tolerance: NotRequired[float]
    """what all effects left out may change together, relative"""
    accuracy: NotRequired[float]
    """wanted relative numerical accuracy"""
    restitution: float | RestitutionRange
    """physical coefficient of restitution of what is struck"""
    blow_frequency_hz: NotRequired[float | None]
    """blows per second, one a turn of the crank"""
    impact_speed_m_s: NotRequired[float | None]
    """of the tool, just before the blow"""
    impact_energy_j: NotRequired[float | None]
    """of the rocker and tool, just before the blow"""
    tool_radius_mm: NotRequired[float | None]
    """null: the rocker's length"""
    limits: NotRequired[LinkageLimits]
    drive: NotRequired[Drive | None]
    coupler_stiffness_n_m: NotRequired[float | None]
    """calls up the effect coupler_elasticity"""
    length_tolerance_mm: NotRequired[float | None]
    """by how much each length may be off; calls up the effect tolerances"""
    type: NotRequired[Literal["largest_coupler", "largest_rocker", "largest_base"] | None]
    """null: recognised from the lengths"""
    ratios: NotRequired[RatioGiven | None]
    lengths_mm: NotRequired[LinkLengths | None]


class ImpactLinkageCheckRun(TypedDict):
    """A run: whether the part holds, what was asked for, what came out, which effects were computed, how accurate it
    is and what it took. ``status`` says only how the solve ended."""

    id: str
    kind: str
    mode: Mode
    status: RunStatus
    name: str
    created_at: str
    spec_hash: str
    cached: bool
    batch_id: str | None
    holds: bool | None
    """the verdict's own; null: there is no verdict"""
    figure: Figure | None
    """null: there is no result, or the run is of before figures"""
    solver: Solver
    verdict: VerdictResult | None
    """of every design and check that has an answer; null of all others, and of runs of before verdicts"""
    spec: ImpactLinkageCheckRequest
    result: LinkageResult | Infeasible | None
    problem: ProblemDetails | None
    effects: list[EffectResult]
    accuracy: AccuracyResult | None
    timing: dict[str, float]
    links: Links
    progress: RunProgress | None
    """of a run under way, where it is a long one"""


class ImpactLinkageDesignRequest(TypedDict):
    """The best linkage over the allowed types."""

    time_budget_s: NotRequired[float | None]
    """wall-clock time that this design may take, at most the service's own limit; null: that limit. A kind that
    finds better and better designs answers with the best that meets every requirement, with the gap that is left
    and accuracy.met false; any other run that does not end in time fails"""
    name: NotRequired[str]
    """a name for people; it changes no result"""
    effects: NotRequired[Literal["auto", "all"] | EffectChoice]
    """auto, all, or a choice with include and exclude"""
    effect_tolerance: NotRequired[float]
    """what all effects left out may change together, relative"""
    accuracy: NotRequired[float]
    """wanted relative numerical accuracy"""
    restitution: float | RestitutionRange
    """physical coefficient of restitution of what is struck"""
    blow_frequency_hz: NotRequired[float | None]
    """blows per second, one a turn of the crank"""
    impact_speed_m_s: NotRequired[float | None]
    """of the tool, just before the blow"""
    impact_energy_j: NotRequired[float | None]
    """of the rocker and tool, just before the blow"""
    tool_radius_mm: NotRequired[float | None]
    """null: the rocker's length"""
    limits: NotRequired[LinkageLimits]
    drive: NotRequired[Drive | None]
    coupler_stiffness_n_m: NotRequired[float | None]
    """calls up the effect coupler_elasticity"""
    length_tolerance_mm: NotRequired[float | None]
    """by how much each length may be off; calls up the effect tolerances"""
    types: NotRequired[list[Literal["largest_coupler", "largest_rocker", "largest_base"]]]
    """the types allowed"""
    objective: NotRequired[Literal["box_area", "longest_link", "enclosing_radius", "peak_torque", "pin_force", "impact_speed", "blow_frequency"]]
    front: NotRequired[FrontRequest]
    """against none: the best linkage alone"""


class ImpactLinkageDesignResult(TypedDict):
    """The linkage found, the limits that shape it, the best of every allowed type, and how it is known to be best."""

    type: str
    lengths_mm: Lengths | None
    ratios: Ratios
    closure: ClosureResult
    rotatable: bool
    confined_deg: float | None
    """a crank that cannot turn stays within ± this of the blow"""
    u31_start: float | None
    """magnitude, just after the blow"""
    u31_end: float | None
    """magnitude, just before it"""
    u31_max: float | None
    """greatest magnitude over the cycle"""
    kinematic_restitution: float | None
    restitution_mismatch: float | None
    """worst |R - R_k| over the range asked for"""
    rocker_swing_deg: float | None
    transmission_angle_deg: float | None
    """between coupler and rocker in mid-cycle"""
    blow_frequency_hz: float | None
    impact_speed_m_s: float | None
    longest_link_mm: float | None
    box_mm: SweptBox | None
    box_area_mm2: float | None
    enclosing_radius_mm: float | None
    peak_torque_nm: float | None
    """at the crank, from the rocker's inertia alone"""
    peak_torque_at_deg: float | None
    pin_force_n: float | None
    """peak along the coupler, likewise"""
    pin_force_at_deg: float | None
    coupler_peak_n: float | None
    """peak after a blow that mismatches, from the coupler's elasticity"""
    window: WindowResult | None
    """null: the lengths close"""
    restitution_error: float | None
    """relative, for lengths off by their tolerance"""
    tolerance_window: WindowResult | None
    running_frequency_hz: float | None
    """with the drive: blows per second in steady running"""
    running_speed_m_s: float | None
    irregularity: float | None
    """(greatest - least)/mean speed of the crank"""
    crank_speed_jump: float | None
    """relative, at the blow"""
    motor_power_w: float | None
    transfer: list[Sample]
    warnings: list[str]
    objective: str
    value: float
    value_unit: str
    active_limits: list[str]
    alternatives: list[AlternativeResult]
    front: FrontResult | None
    certificate: CertificateResult | None


class ImpactLinkageDesignRun(TypedDict):
    """A run: whether the part holds, what was asked for, what came out, which effects were computed, how accurate it
    is and what it took. ``status`` says only how the solve ended."""

    id: str
    kind: str
    mode: Mode
    status: RunStatus
    name: str
    created_at: str
    spec_hash: str
    cached: bool
    batch_id: str | None
    holds: bool | None
    """the verdict's own; null: there is no verdict"""
    figure: Figure | None
    """null: there is no result, or the run is of before figures"""
    solver: Solver
    verdict: VerdictResult | None
    """of every design and check that has an answer; null of all others, and of runs of before verdicts"""
    spec: ImpactLinkageDesignRequest
    result: ImpactLinkageDesignResult | Infeasible | None
    problem: ProblemDetails | None
    effects: list[EffectResult]
    accuracy: AccuracyResult | None
    timing: dict[str, float]
    links: Links
    progress: RunProgress | None
    """of a run under way, where it is a long one"""


class ImpactLinkageStudyRequest(TypedDict):
    """The case, what is wanted of a solution, and how long the levels may be timed."""

    time_budget_s: NotRequired[float | None]
    """what one solution may take; null: the spec's accuracy decides what is recommended"""
    study_budget_s: NotRequired[float]
    """time of the independent reference and of the runs, the tightest solution not counted; an independent reference
    that takes too long is given up, rungs that the time does not reach are left out"""
    spec: ImpactLinkageDesignRequest | ImpactLinkageCheckRequest
    """a design request or a check request of this kind"""


class IndicatorLoad(TypedDict):
    """An indicator diagram of a two-stroke cycle on the piston's own bore, unrolled by the machine's motion."""

    kind: Literal["indicator"]
    strokes: list[Stroke]
    """four strokes: intake, compression, expansion, exhaust; two strokes: expansion, compression"""
    repair: NotRequired[bool]
    """mend what is wrong with the points, and record it"""
    clearance_volume_cm3: NotRequired[float]
    """volume at the upper dead centre"""
    back_pressure_mpa: NotRequired[float | None]
    """null: the mean of the cycle"""


class IndicatorPressure(TypedDict):
    """An indicator diagram of the cylinder."""

    kind: Literal["indicator"]
    strokes: list[Stroke]
    """four strokes: intake, compression, expansion, exhaust; two strokes: expansion, compression"""
    repair: NotRequired[bool]
    """mend what is wrong with the points, and record it"""


class Infeasible(TypedDict):
    """Why there is no design."""

    diagnosis: list[ShortfallResult]
    certificate: NotRequired[CertificateResult | None]
    repairs: NotRequired[list[RepairDone]]
    """what was done to the request's points"""


class InfeasibleResult(TypedDict):
    """Why no pin of this outer diameter will do, and what would."""

    diagnosis: list[ShortfallResult]
    force_limit_n: float | None
    infeasible_from_mm: float | None
    infeasible_to_mm: float | None
    least_outer_diameter_mm: float | None
    """all else equal; null where no diameter helps"""
    certificate: NotRequired[CertificateResult | None]


class Jump(TypedDict):
    angle_deg: float
    jump_mpa: float
    """pressure just behind the dead centre less that just before it"""


class Lengths(TypedDict):
    base: float
    crank: float
    coupler: float
    rocker: float


class LevelResult(TypedDict):
    """One rung of the ladder."""

    accuracy: float
    settings: dict[str, float | int | str]
    error: float | None
    """greatest relative error over the main results; null: the level failed"""
    errors: dict[str, float]
    """never less than the reference may be off itself"""
    at_most: bool
    """true: lost in what the reference may be off, which is shown instead"""
    proven_gap: float | None
    """how far a proof leaves the best design there may be; null: no proof"""
    time_min_s: float
    time_median_s: float
    runs: int


class LinkLengths(TypedDict):
    base: NotRequired[float | None]
    crank: NotRequired[float | None]
    coupler: NotRequired[float | None]
    rocker: NotRequired[float | None]


class LinkageLimits(TypedDict):
    """What the mechanism must keep; null: no such limit."""

    min_link_mm: NotRequired[float | None]
    """least length of any link"""
    joint_radius_mm: NotRequired[float | None]
    """room around every joint, added on all sides"""
    longest_link_mm: NotRequired[float | None]
    width_mm: NotRequired[float | None]
    """of the swept box; calls for the effect envelope"""
    height_mm: NotRequired[float | None]
    """of the swept box; calls for the effect envelope"""
    enclosing_radius_mm: NotRequired[float | None]
    """of a circle (a pipe) around all it sweeps"""
    max_pin_force_n: NotRequired[float | None]
    transmission_angle_deg: NotRequired[list[float] | None]
    """range of the angle between coupler and rocker in mid-cycle; null: any"""


class LinkageResult(TypedDict):
    """What a linkage does; null where a result does not exist (it cannot strike, an effect or an input is missing)."""

    type: str
    lengths_mm: Lengths | None
    ratios: Ratios
    closure: ClosureResult
    rotatable: bool
    confined_deg: float | None
    """a crank that cannot turn stays within ± this of the blow"""
    u31_start: float | None
    """magnitude, just after the blow"""
    u31_end: float | None
    """magnitude, just before it"""
    u31_max: float | None
    """greatest magnitude over the cycle"""
    kinematic_restitution: float | None
    restitution_mismatch: float | None
    """worst |R - R_k| over the range asked for"""
    rocker_swing_deg: float | None
    transmission_angle_deg: float | None
    """between coupler and rocker in mid-cycle"""
    blow_frequency_hz: float | None
    impact_speed_m_s: float | None
    longest_link_mm: float | None
    box_mm: SweptBox | None
    box_area_mm2: float | None
    enclosing_radius_mm: float | None
    peak_torque_nm: float | None
    """at the crank, from the rocker's inertia alone"""
    peak_torque_at_deg: float | None
    pin_force_n: float | None
    """peak along the coupler, likewise"""
    pin_force_at_deg: float | None
    coupler_peak_n: float | None
    """peak after a blow that mismatches, from the coupler's elasticity"""
    window: WindowResult | None
    """null: the lengths close"""
    restitution_error: float | None
    """relative, for lengths off by their tolerance"""
    tolerance_window: WindowResult | None
    running_frequency_hz: float | None
    """with the drive: blows per second in steady running"""
    running_speed_m_s: float | None
    irregularity: float | None
    """(greatest - least)/mean speed of the crank"""
    crank_speed_jump: float | None
    """relative, at the blow"""
    motor_power_w: float | None
    transfer: list[Sample]
    warnings: list[str]


class Links(TypedDict):
    """Where a run and what belongs to it are found."""

    self: str
    page: str
    plots: dict[str, str]
    exports: dict[str, str]


class Load(TypedDict):
    force_n: float
    """greatest force on the piston"""


class Masses(TypedDict):
    piston_kg: float
    """piston group: piston, rings, wrist pin"""
    rod_kg: float
    rod_cg_from_pin_mm: float
    """wrist pin to the rod's centre of mass"""
    rod_inertia_kg_m2: NotRequired[float | None]
    """about the centre of mass; null: that of the two-mass model"""
    crank_pin_kg: NotRequired[float]
    web_kg: NotRequired[float]
    """one of the throw's two webs"""
    web_radius_mm: NotRequired[float]
    counterweight_kg: NotRequired[float]
    """all counterweights of the throw together"""
    counterweight_radius_mm: NotRequired[float]
    rods_per_pin: NotRequired[Literal[1, 2]]
    """2 where the rods of a V share a crank pin"""

MassesRequest = Union["PendulumRequest", "WeighingRequest", "EstimateRequest"]


class MassesResult(TypedDict):
    """What was found, null where the method cannot tell; ``_u`` are standard uncertainties, null where unknown."""

    rod_cg_from_pin_mm: float | None
    rod_cg_from_pin_mm_u: float | None
    rod_mass_at_pin_kg: float | None
    rod_mass_at_pin_kg_u: float | None
    rod_mass_at_crank_kg: float | None
    rod_mass_at_crank_kg_u: float | None
    rod_inertia_kg_m2: float | None
    rod_inertia_kg_m2_u: float | None
    inertia_defect_kg_m2: float | None
    inertia_defect_kg_m2_u: float | None
    piston_mass_kg: float | None
    piston_mass_kg_u: float | None
    rod_mass_kg: float | None
    rod_mass_kg_u: float | None
    uncertainty_method: str | None
    """linear, or Monte Carlo where the linear law fails"""
    intervals: dict[str, list[float]]
    """the middle 95 % by Monte Carlo, where that was needed"""
    warnings: list[str]


class Material(TypedDict):
    allowable_stress_mpa: float
    allowable_shear_mpa: NotRequired[float | None]
    """null: the criterion alone"""
    elastic_modulus_gpa: float
    poisson: NotRequired[float]
    density_kg_m3: float

Mode = Literal["design", "check", "analysis", "accuracy"]


class PendulumRequest(TypedDict):
    """The rod swings from its small end, then from its big end."""

    name: NotRequired[str]
    """a name for people; it changes no result"""
    effects: NotRequired[Literal["auto", "all"] | EffectChoice]
    """auto, all, or a choice with include and exclude"""
    effect_tolerance: NotRequired[float]
    """what all effects left out may change together, relative"""
    accuracy: NotRequired[float]
    """wanted relative numerical accuracy"""
    method: Literal["pendulum"]
    pivot_distance_mm: float
    """between the two knife edges"""
    period_small_end_s: float
    """hung at the small end"""
    period_big_end_s: float
    """hung at the big end"""
    rod_mass_kg: float
    amplitude_deg: NotRequired[float]
    """how far the rod swings to either side"""
    gravity_m_s2: NotRequired[float]
    small_end_bore_radius_mm: NotRequired[float]
    """where the edge carries the bore's inside"""
    big_end_bore_radius_mm: NotRequired[float]
    uncertainty: NotRequired[PendulumUncertainty]


class PendulumUncertainty(TypedDict):
    """Standard uncertainties of what was measured."""

    pivot_distance_mm: NotRequired[float]
    period_small_end_s: NotRequired[float]
    period_big_end_s: NotRequired[float]
    rod_mass_kg: NotRequired[float]
    amplitude_deg: NotRequired[float]
    gravity_m_s2: NotRequired[float]
    small_end_bore_radius_mm: NotRequired[float]
    big_end_bore_radius_mm: NotRequired[float]


class PinCertificate(TypedDict):
    """How a pin is known to be the lightest of its form."""

    method: str
    """by which argument"""
    bound: float | None
    """no feasible design is better, in the objective's unit; null: none exists"""
    gap: float | None
    """relative distance of the answer, as it is told, from the bound; null: no bound is known"""
    evidence: dict[str, float | int | str]
    proven: str
    """what is proven"""
    physics: str
    """for which physics"""
    form: str
    """for which designs"""
    range: str
    """over which range of them"""
    estimated: list[str]
    """what is only estimated, and where it is told"""
    lower_bound_g: float
    """no pin of this form that keeps the limits is lighter"""


class PinLimits(TypedDict):
    """What the pin must keep besides strength; null: no such limit."""

    min_wall_mm: NotRequired[float | None]
    """least wall thickness"""
    max_deflection_um: NotRequired[float | None]
    """of the middle against the bosses' edges"""
    max_ovalization_um: NotRequired[float | None]
    """calls for the effect ovalization"""
    max_slope: NotRequired[float | None]
    """change of the bore's diameter per length"""
    max_ring_stress_mpa: NotRequired[float | None]
    """hoop stress of the ring; calls for the effect ovalization. null: no limit on a design, but the verdict judges
    it by the allowable stress. Textbooks let hardened pins go to 300 to 350 MPa"""


class PinProfileAccuracyRun(TypedDict):
    """A run: whether the part holds, what was asked for, what came out, which effects were computed, how accurate it
    is and what it took. ``status`` says only how the solve ended."""

    id: str
    kind: str
    mode: Mode
    status: RunStatus
    name: str
    created_at: str
    spec_hash: str
    cached: bool
    batch_id: str | None
    holds: bool | None
    """the verdict's own; null: there is no verdict"""
    figure: Figure | None
    """null: there is no result, or the run is of before figures"""
    solver: Solver
    verdict: VerdictResult | None
    """of every design and check that has an answer; null of all others, and of runs of before verdicts"""
    spec: PinProfileStudyRequest
    result: StudyResult | InfeasibleResult | None
    problem: ProblemDetails | None
    effects: list[EffectResult]
    accuracy: AccuracyResult | None
    timing: dict[str, float]
    links: Links
    progress: RunProgress | None
    """of a run under way, where it is a long one"""


class PinProfileCheckRequest(TypedDict):
    """A pin with a given bore, or a bushing with a given outside: one all along, or points joined by straight lines."""

    name: NotRequired[str]
    """a name for people; it changes no result"""
    effects: NotRequired[Literal["auto", "all"] | EffectChoice]
    """auto, all, or a choice with include and exclude"""
    effect_tolerance: NotRequired[float]
    """what all effects left out may change together, relative"""
    accuracy: NotRequired[float]
    """wanted relative numerical accuracy"""
    geometry: Geometry
    load: Load | RunForce
    material: Material
    criterion: NotRequired[Literal["tresca_paper", "fibre", "saint_venant", "von_mises"]]
    """how bending and shear join in one equivalent stress"""
    limits: NotRequired[PinLimits]
    form: NotRequired[BoreForm]
    """of what a design seeks; a drillable outside does not narrow toward the middle"""
    variable: NotRequired[Literal["bore", "outer"]]
    """bore: the pin, outer diameter given; outer: the bushing, bore_mm given"""
    bore_mm: NotRequired[float | None]
    """one bore all along: of the pin that is checked, or of the bushing"""
    profile: NotRequired[list[Point] | None]
    """points that do not fall in x; two at one x are a step; half a pin stands for both. With bore_mm, or
    outer_diameter_mm for a bushing"""


class PinProfileCheckRun(TypedDict):
    """A run: whether the part holds, what was asked for, what came out, which effects were computed, how accurate it
    is and what it took. ``status`` says only how the solve ended."""

    id: str
    kind: str
    mode: Mode
    status: RunStatus
    name: str
    created_at: str
    spec_hash: str
    cached: bool
    batch_id: str | None
    holds: bool | None
    """the verdict's own; null: there is no verdict"""
    figure: Figure | None
    """null: there is no result, or the run is of before figures"""
    solver: Solver
    verdict: VerdictResult | None
    """of every design and check that has an answer; null of all others, and of runs of before verdicts"""
    spec: PinProfileCheckRequest
    result: PinResult | Infeasible | None
    problem: ProblemDetails | None
    effects: list[EffectResult]
    accuracy: AccuracyResult | None
    timing: dict[str, float]
    links: Links
    progress: RunProgress | None
    """of a run under way, where it is a long one"""


class PinProfileDesignRequest(TypedDict):
    """The lightest pin or bushing of a form."""

    time_budget_s: NotRequired[float | None]
    """wall-clock time that this design may take, at most the service's own limit; null: that limit. A kind that
    finds better and better designs answers with the best that meets every requirement, with the gap that is left
    and accuracy.met false; any other run that does not end in time fails"""
    name: NotRequired[str]
    """a name for people; it changes no result"""
    effects: NotRequired[Literal["auto", "all"] | EffectChoice]
    """auto, all, or a choice with include and exclude"""
    effect_tolerance: NotRequired[float]
    """what all effects left out may change together, relative"""
    accuracy: NotRequired[float]
    """wanted relative numerical accuracy"""
    geometry: Geometry
    load: Load | RunForce
    material: Material
    criterion: NotRequired[Literal["tresca_paper", "fibre", "saint_venant", "von_mises"]]
    """how bending and shear join in one equivalent stress"""
    limits: NotRequired[PinLimits]
    form: NotRequired[BoreForm]
    """of what a design seeks; a drillable outside does not narrow toward the middle"""
    variable: NotRequired[Literal["bore", "outer"]]
    """bore: the pin, outer diameter given; outer: the bushing, bore_mm given"""
    bore_mm: NotRequired[float | None]
    """one bore all along: of the pin that is checked, or of the bushing"""


class PinProfileDesignResult(TypedDict):
    """The pin found, what other forms weigh beside it, and how it is known to be the lightest."""

    mass_g: float
    solid_mass_g: float | None
    """of the same pin without a bore; null for a bushing"""
    constant_bore_mass_g: float | None
    """the best pin of one bore (bushing: of one outer diameter) under the same limits"""
    min_bore_mm: float
    bore_mid_mm: float
    outer_max_mm: float
    outer_mid_mm: float
    least_wall_mm: float
    max_moment_nmm: float
    max_shear_n: float
    equivalent_stress_max_mpa: float | None
    worst_section_mm: float
    shear_stress_max_mpa: float | None
    """null without an allowable shear"""
    strength_utilisation: float | None
    deflection_um: float | None
    ovalization_um: float | None
    """in the middle of the pin"""
    ovalization_max_um: float | None
    """where the bore is widest; null where the wall runs out"""
    ovalization_stress_max_mpa: float | None
    """greatest hoop stress of the ring, where the wall is thinnest; null where the wall runs out"""
    ring_model: str | None
    ring_stresses_mpa: RingStressesResult | None
    contact_pressures_mpa: PressuresResult | None
    force_limit_n: float | None
    """the greatest force that a solid pin carries; null for a bushing, which has none"""
    profile: list[Section]
    warnings: list[str]
    form: str
    free_mass_g: float
    """the lightest of any form under the same limits, but for the slope"""
    corners: list[Corner] | None
    """where the shape is made of straight lines: its points"""
    certificate: PinCertificate | None


class PinProfileDesignRun(TypedDict):
    """A run: whether the part holds, what was asked for, what came out, which effects were computed, how accurate it
    is and what it took. ``status`` says only how the solve ended."""

    id: str
    kind: str
    mode: Mode
    status: RunStatus
    name: str
    created_at: str
    spec_hash: str
    cached: bool
    batch_id: str | None
    holds: bool | None
    """the verdict's own; null: there is no verdict"""
    figure: Figure | None
    """null: there is no result, or the run is of before figures"""
    solver: Solver
    verdict: VerdictResult | None
    """of every design and check that has an answer; null of all others, and of runs of before verdicts"""
    spec: PinProfileDesignRequest
    result: PinProfileDesignResult | InfeasibleResult | None
    problem: ProblemDetails | None
    effects: list[EffectResult]
    accuracy: AccuracyResult | None
    timing: dict[str, float]
    links: Links
    progress: RunProgress | None
    """of a run under way, where it is a long one"""


class PinProfileStudyRequest(TypedDict):
    """The case, what is wanted of a solution, and how long the levels may be timed."""

    time_budget_s: NotRequired[float | None]
    """what one solution may take; null: the spec's accuracy decides what is recommended"""
    study_budget_s: NotRequired[float]
    """time of the independent reference and of the runs, the tightest solution not counted; an independent reference
    that takes too long is given up, rungs that the time does not reach are left out"""
    spec: PinProfileDesignRequest | PinProfileCheckRequest
    """a design request or a check request of this kind"""


class PinResult(TypedDict):
    """What a pin does under its load; null where a result does not exist (an effect that did not run, no wall)."""

    mass_g: float
    solid_mass_g: float | None
    """of the same pin without a bore; null for a bushing"""
    constant_bore_mass_g: float | None
    """the best pin of one bore (bushing: of one outer diameter) under the same limits"""
    min_bore_mm: float
    bore_mid_mm: float
    outer_max_mm: float
    outer_mid_mm: float
    least_wall_mm: float
    max_moment_nmm: float
    max_shear_n: float
    equivalent_stress_max_mpa: float | None
    worst_section_mm: float
    shear_stress_max_mpa: float | None
    """null without an allowable shear"""
    strength_utilisation: float | None
    deflection_um: float | None
    ovalization_um: float | None
    """in the middle of the pin"""
    ovalization_max_um: float | None
    """where the bore is widest; null where the wall runs out"""
    ovalization_stress_max_mpa: float | None
    """greatest hoop stress of the ring, where the wall is thinnest; null where the wall runs out"""
    ring_model: str | None
    ring_stresses_mpa: RingStressesResult | None
    contact_pressures_mpa: PressuresResult | None
    force_limit_n: float | None
    """the greatest force that a solid pin carries; null for a bushing, which has none"""
    profile: list[Section]
    warnings: list[str]


class Piston(TypedDict):
    diameter_mm: float
    skirt_length_mm: float
    reciprocating_mass_kg: NotRequired[float]
    """piston and the rod's upper share"""
    clamp_offset_mm: NotRequired[float]
    """e, clamp from mid-skirt toward the crank"""
    friction_coefficient: NotRequired[float]


class Point(TypedDict):
    """A place, and what is sought there: a pin's bore or a bushing's outer diameter."""

    x_mm: float
    bore_mm: NotRequired[float | None]
    outer_diameter_mm: NotRequired[float | None]


class PressuresResult(TypedDict):
    small_end: float
    boss_mean: float
    boss_peak: float


class ProblemDetails(TypedDict):
    """A refusal (RFC 9457)."""

    type: str
    title: str
    status: int
    detail: str
    errors: NotRequired[list[ProblemEntry]]


class ProblemEntry(TypedDict):
    """One bad field."""

    pointer: str
    """JSON pointer of the field (RFC 6901)"""
    detail: str
    allowed: str


class RatioGiven(TypedDict):
    """The free ratio of the type: lambda2 (coupler/crank), or lambda0 (base/crank) for largest_base."""

    lambda0: NotRequired[float | None]
    lambda2: NotRequired[float | None]


class Ratios(TypedDict):
    """Links over crank."""

    lambda0: float
    lambda2: float
    lambda3: float


class RepairDone(TypedDict):
    """What was done to a user's points, and where the fault was first seen."""

    pointer: str
    what: str


class Requirements(TypedDict):
    """Least safeties and greatest loads of the piston's guide."""

    min_fatigue_safety: NotRequired[float]
    """against fatigue"""
    min_stability_safety: NotRequired[float]
    """against buckling"""
    max_contact_pressure_mpa: NotRequired[float | None]
    """calls for the effect friction"""
    max_friction_power_w: NotRequired[float | None]
    """calls for the effect friction"""
    min_yield_safety: NotRequired[float | None]
    """against yield; null: 1 in the verdict alone"""


class RestitutionRange(TypedDict):
    """Where the restitution is not known better: the mechanism is made for the middle."""

    low: float
    high: float


class RingStressesResult(TypedDict):
    """Hoop stresses in the middle of the pin: at the side and under the load, outside and inside."""

    outer_side: float
    inner_side: float
    outer_top: float
    inner_top: float


class RodBounds(TypedDict):
    b_mm: list[float]
    """least and greatest"""
    h_mm: list[float]
    """least and greatest"""
    l_mm: list[float]
    """least and greatest"""


class RodResult(TypedDict):
    """What a strip does in its machine; null where a result does not exist (no load, no effect, no stability)."""

    dimensions: Dimensions
    fatigue_safety: float | None
    stability_safety: float | None
    yield_safety: float | None
    critical_force_n: float
    buckles_sideways: bool
    axial_force_min_n: float
    axial_force_max_n: float
    stress_amplitude_mpa: float | None
    stress_mean_mpa: float | None
    worst_section_mm: float | None
    worst_fibre: int | None
    side_force_max_n: float | None
    clamp_moment_max_nmm: float | None
    contact_pressure_max_mpa: float | None
    friction_power_w: float | None
    deflection_ratio: float | None
    natural_frequency_hz: float
    mass_g: float
    fatigue_criterion: str
    repairs: list[RepairDone]
    """what was done to the load's points; empty unless asked for"""
    warnings: list[str]


class Run(TypedDict):
    """A run: whether the part holds, what was asked for, what came out, which effects were computed, how accurate it
    is and what it took. ``status`` says only how the solve ended."""

    id: str
    kind: str
    mode: Mode
    status: RunStatus
    name: str
    created_at: str
    spec_hash: str
    cached: bool
    batch_id: str | None
    holds: bool | None
    """the verdict's own; null: there is no verdict"""
    figure: Figure | None
    """null: there is no result, or the run is of before figures"""
    solver: Solver
    verdict: VerdictResult | None
    """of every design and check that has an answer; null of all others, and of runs of before verdicts"""
    spec: dict[str, Any]
    result: dict[str, Any] | None
    problem: ProblemDetails | None
    effects: list[EffectResult]
    accuracy: AccuracyResult | None
    timing: dict[str, float]
    links: Links
    progress: RunProgress | None
    """of a run under way, where it is a long one"""


class RunForce(TypedDict):
    """The force at a worst instant of a stored crank-dynamics run; the service fills in what it takes from there."""

    kind: Literal["run"]
    run_id: str
    """the id of a stored run"""
    instant: NotRequired[Literal["gas_force_max", "rod_compression_max", "rod_tension_max", "side_force_max", "wrist_pin_load_max", "crank_pin_load_max", "main_bearing_load_max"]]
    """which greatest force is taken"""
    force_n: NotRequired[float | None]
    """filled in from the run"""
    taken_from: NotRequired[str | None]
    """filled in: kind and hash of the run's own request"""


class RunLine(TypedDict):
    """A line of the listing."""

    id: str
    kind: str
    mode: Mode
    status: RunStatus
    name: str
    created_at: str
    spec_hash: str
    cached: bool
    batch_id: str | None
    holds: bool | None
    """the verdict's own; null: there is no verdict"""
    figure: Figure | None
    """null: there is no result, or the run is of before figures"""
    solver: Solver


class RunLoad(TypedDict):
    """A stored crank-dynamics run: its pressures (two strokes), or the one of a worst instant at all angles. The
    service fills in what it takes from the run."""

    kind: Literal["run"]
    run_id: str
    """the id of a stored run"""
    instant: NotRequired[Literal["gas_force_max", "rod_compression_max", "rod_tension_max", "side_force_max", "wrist_pin_load_max", "crank_pin_load_max", "main_bearing_load_max"] | None]
    """null: all pressures; or the pressure of that instant"""
    back_pressure_mpa: NotRequired[float | None]
    """null: the run's crankcase pressure"""
    angle_deg: NotRequired[list[float] | None]
    """filled in from the run"""
    pressure_mpa: NotRequired[list[float] | None]
    """filled in from the run"""
    taken_from: NotRequired[str | None]
    """filled in: kind and hash of the run's own request"""

RunOrder = Literal["newest", "oldest", "name", "least", "greatest"]


class RunPage(TypedDict):
    """A page of the listing; ``next_cursor`` asks for the next one."""

    items: list[RunLine]
    next_cursor: str | None
    damaged: list[str]
    """ids of runs that belong here too, but whose records are damaged"""


class RunProgress(TypedDict):
    """How far a run is."""

    done: int
    """solutions that are there"""
    of: int
    """at most; a time budget may end the run before"""
    doing: str

RunStatus = Literal["queued", "running", "succeeded", "infeasible", "failed", "cancelled"]


class Sample(TypedDict):
    phi_deg: float
    u31: float


class SchmidtLoad(TypedDict):
    """p = p_min (1 + delta)/(1 - delta cos(phi - theta)): the isothermal Stirling cycle."""

    kind: Literal["schmidt"]
    p_min_mpa: float
    delta: float
    """compression parameter"""
    theta_rad: float
    """angle of greatest pressure"""
    back_pressure_mpa: NotRequired[float | None]
    """null: the mean of the cycle"""


class Section(TypedDict):
    """The pin at one place."""

    x_mm: float
    bore_mm: float
    outer_diameter_mm: float
    moment_nmm: float
    shear_n: float
    equivalent_stress_mpa: float | None
    """null: a load where there is no wall"""


class Series(TypedDict):
    """One column per quantity; compression of the rod is positive, the radial force points to the shaft."""

    angle_deg: list[float]
    pressure_mpa: list[float]
    brix_pressure_mpa: list[float] | None
    """unrolled by Brix's construction; null: not unrolled"""
    gas_force_n: list[float]
    inertia_force_n: list[float]
    side_force_n: list[float]
    rod_force_n: list[float]
    tangential_force_n: list[float]
    radial_force_n: list[float]
    torque_nm: list[float]
    wrist_pin_load_n: list[float]
    crank_pin_load_n: list[float]
    main_bearing_load_n: list[float]


class ShortfallResult(TypedDict):
    """A requirement that cannot be met."""

    requirement: str
    required: float
    attainable: float | None
    """the best to be had; null: nothing"""
    advice: str


class Solver(TypedDict):
    """Who solved."""

    name: str
    version: str


class Steps(TypedDict):
    """Steps to whose multiples width and free length are rounded; null: not rounded."""

    b: NotRequired[float | None]
    l: NotRequired[float | None]


class Stroke(TypedDict):
    """The points of one stroke; volumes with the clearance volume, in either order."""

    volume_cm3: list[float]
    pressure_mpa: list[float]
    """one for each volume"""


class StudyResult(TypedDict):
    """Error against time, from loose to tight; and the effects, each turned about in turn."""

    levels: list[LevelResult]
    reference: str
    """how the reference was made"""
    reference_accuracy: float
    """what it may be off, relative, in the result of which it knows least"""
    recommended: LevelResult | None
    """the cheapest level that meets the spec's accuracy, or the best within the time"""
    certified: LevelResult | None
    """the cheapest level whose design is proven to be the best to the spec's accuracy, or else the one with the
    closest proof; null: nothing is proven"""
    effect_costs: list[EffectCostResult]


class Sweep(TypedDict):
    """A request of which some fields are varied."""

    kind: str
    mode: Literal["design", "check", "analysis", "accuracy"]
    name: NotRequired[str]
    detail: NotRequired[Literal["scalars", "full"]]
    base: dict[str, Any]
    """what every request has"""
    vary: dict[str, Vary]
    """dotted field: its values"""
    combine: NotRequired[Literal["grid", "zip", "latin_hypercube", "sobol"]]
    samples: NotRequired[int | None]
    """of latin_hypercube and sobol"""
    seed: NotRequired[int]


class SweptBox(TypedDict):
    """The least box around all that links and joints sweep; ``angle_deg`` from the base line to its width."""

    width: float
    height: float
    angle_deg: float


class TableLoad(TypedDict):
    """Pressures at crank angles, joined by a monotone periodic cubic."""

    kind: Literal["table"]
    angle_deg: list[float]
    """rising, within one turn"""
    pressure_mpa: list[float]
    """one for each angle"""
    back_pressure_mpa: NotRequired[float | None]
    """null: the mean of the cycle"""


class TablePressure(TypedDict):
    """Pressures at crank angles of one cycle, joined by a monotone periodic cubic."""

    kind: Literal["table"]
    angle_deg: list[float]
    """rising, within one cycle"""
    pressure_mpa: list[float]
    """one for each angle"""
    repair: NotRequired[bool]
    """mend what is wrong with the points, and record it"""


class Unbalance(TypedDict):
    order: int
    force_n: float
    couple_nm: float | None

Vary = TypedDict(
    "Vary",
    {
        "values": NotRequired[Union[list[Any], None]],
        "from": NotRequired[Union[float, None]],
        "to": NotRequired[Union[float, None]],
        "steps": NotRequired[Union[int, None]],
        "scale": NotRequired[Literal["linear", "log"]],
    },
)


class VerdictResult(TypedDict):
    """Whether the part holds: true only if every criterion does."""

    holds: bool
    summary: str
    """one sentence with the figure that governs"""
    governed_by: str | None
    """the criterion that fails most, or has least to spare; null: none acts"""
    criteria: list[CriterionResult]
    cautions: list[str]
    """what to know beside the criteria"""


class WeighingRequest(TypedDict):
    """The rod lies level on two supports at its pin centres; a period adds the moment of inertia."""

    name: NotRequired[str]
    """a name for people; it changes no result"""
    effects: NotRequired[Literal["auto", "all"] | EffectChoice]
    """auto, all, or a choice with include and exclude"""
    effect_tolerance: NotRequired[float]
    """what all effects left out may change together, relative"""
    accuracy: NotRequired[float]
    """wanted relative numerical accuracy"""
    method: Literal["weighing"]
    length_mm: float
    """between the pin centres"""
    small_end_reading_kg: float
    big_end_reading_kg: float
    rod_mass_kg: NotRequired[float | None]
    """weighed by itself, to see whether the readings close"""
    period_small_end_s: NotRequired[float | None]
    """hung at the small end; null: no inertia"""
    small_end_bore_radius_mm: NotRequired[float]
    amplitude_deg: NotRequired[float]
    """how far the rod swings to either side"""
    gravity_m_s2: NotRequired[float]
    uncertainty: NotRequired[WeighingUncertainty]


class WeighingUncertainty(TypedDict):
    """Standard uncertainties of what was measured."""

    length_mm: NotRequired[float]
    small_end_reading_kg: NotRequired[float]
    big_end_reading_kg: NotRequired[float]
    period_small_end_s: NotRequired[float]
    amplitude_deg: NotRequired[float]
    gravity_m_s2: NotRequired[float]
    small_end_bore_radius_mm: NotRequired[float]


class WindowResult(TypedDict):
    """What a missed closure does about the blow."""

    angle_deg: float
    """half width of the crank angles concerned"""
    blocked: bool
    """true: the crank cannot enter; false: the rocker turns back early"""
    short_stop_deg: float


class WorstInstant(TypedDict):
    """The instant at which one force is greatest."""

    name: str
    angle_deg: float
    force_n: float
    pressure_mpa: float
    feeds: str | None
    """the kind of design that this instant loads"""
