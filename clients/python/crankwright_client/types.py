"""Requests and answers, as the service describes them. Made by scripts/client_types.py: not to be edited."""

from __future__ import annotations

from typing import Any, Literal, Union

from typing_extensions import NotRequired, TypedDict


class AccuracyResult(TypedDict):
    """Requested and estimated accuracy, and the numerical settings used."""

    requested: float
    """requested relative accuracy"""
    estimated: float
    """estimated relative error of the results"""
    met: bool
    """whether estimated is at most requested"""
    settings: dict[str, float | int | str]
    """numerical settings by name"""


class Active(TypedDict):
    name: str
    """a requirement, or a bound such as b_upper"""
    sensitivity: float
    """relative change of the objective for a relative change of the bound"""


class AlternativeResult(TypedDict):
    """The best linkage of a type, or why there is none."""

    type: str
    """type of change-point linkage, or a URI of the kind of problem"""
    value: float | None
    """value of the objective, in the unit of the certificate"""
    lengths_mm: Lengths | None
    """lengths of the four links, in mm; null: only ratios were given"""
    ratios: Ratios | None
    """links over crank"""
    reason: str
    """why the type has no solution; empty: it has one"""


class Batch(TypedDict):
    """Many requests of one kind and mode as one job; each item is a run."""

    id: str
    """identifier of the batch, part of its address"""
    kind: str
    """kind of design"""
    mode: Mode
    """design, check, analysis or accuracy"""
    name: str
    """name"""
    detail: Detail
    """whether curves and tables are stored too"""
    status: Literal["queued", "running", "ended", "cancelled"]
    """state of the batch"""
    created_at: str
    """when the run was requested, UTC"""
    ended_at: str | None
    """when the last item was finished; null: not yet"""
    items: BatchItems
    """number of items, in total and by state"""
    rate_per_s: float | None
    """items per second since the first one started"""
    remaining_s: float | None
    """null: not known yet"""
    solver: Solver
    """the program that solved"""
    links: BatchLinks
    """addresses of the batch and of what belongs to it"""


class BatchItems(TypedDict):
    """Number of items, by outcome."""

    total: int
    """number of all items"""
    done: int
    """items that are finished"""
    succeeded: int
    """items with an answer"""
    infeasible: int
    """items that have no answer, with a diagnosis"""
    failed: int
    """items that ended without an answer"""
    refused: int
    """rows that are not valid requests"""
    cancelled: int
    """items that were cancelled"""


class BatchLinks(TypedDict):
    """URLs of a batch and its resources."""

    self: str
    """the batch as JSON"""
    page: str
    """the batch's web page"""
    results: str
    """results, row by row"""
    events: str
    """progress as server-sent events"""
    runs: str
    """number of timed runs"""


class BatchPage(TypedDict):
    """A page of batches; ``next_cursor`` requests the next one."""

    items: list[Batch]
    """the entries"""
    next_cursor: str | None
    """cursor of the next page; null: this is the last page"""


class BoreForm(TypedDict):
    """The allowed shapes of the bore."""

    kind: NotRequired[Literal["free", "drillable", "constant", "stepped", "double_cone", "cone_cylinder"]]
    """discriminator of the form, or the kind of design"""
    steps: NotRequired[float | None]
    """number of bore steps from each end to the middle; stepped shapes only"""


class CatalogueMaterial(TypedDict):
    name: Literal["paper-strip", "spring-steel-1.1274", "stainless-1.4310"]
    """name of a material in the catalogue"""


class CertificateResult(TypedDict):
    """Proof of a design's optimality: what is proven, over which set, by which argument, and what is not covered."""

    method: str
    """argument of the proof"""
    bound: float | None
    """proven bound on the objective of every feasible design, in the objective's unit; null: none is known"""
    gap: float | None
    """relative distance of the answer from the bound; null: no bound is known"""
    evidence: dict[str, float | int | str]
    """figures that support the proof, by name"""
    proven: str
    """what is proven"""
    physics: str
    """the physics to which the proof applies"""
    form: str
    """the designs to which the proof applies"""
    range: str
    """the range of designs covered"""
    estimated: list[str]
    """what is only estimated, and where the estimate is reported"""


class ClosureResult(TypedDict):
    """Closure of the lengths; the surplus is 0 for a change-point mechanism."""

    surplus_mm: float
    """surplus, in mm"""
    relative: float
    """closure surplus relative to the longest link"""
    closes: bool
    """whether the four links can lie on one line (change-point condition)"""


class ConstantLoad(TypedDict):
    """One pressure at all angles, as a press or a test bench applies it."""

    kind: Literal["constant"]
    """discriminator of the form, or the kind of design"""
    constant_pressure_mpa: float
    """constant pressure, in MPa"""
    back_pressure_mpa: NotRequired[float | None]
    """null: none"""


class Corner(TypedDict):
    x_mm: float
    """x, in mm"""
    bore_mm: float
    """bore, in mm"""
    outer_diameter_mm: float
    """outer diameter, in mm"""


class CrankDynamicsAccuracyRun(TypedDict):
    """A run: verdict, request, result, effects, accuracy and timing. ``status`` describes only how the solve ended."""

    id: str
    """identifier of the run, part of its address"""
    kind: str
    """discriminator of the form, or the kind of design"""
    mode: Mode
    """design, check, analysis or accuracy"""
    status: RunStatus
    """state or outcome of the solve"""
    name: str
    """name"""
    created_at: str
    """when the run was requested, UTC"""
    spec_hash: str
    """SHA-256 of kind, mode and request, without the name"""
    cached: bool
    """whether the answer was taken from an earlier run of the same request by the same solver"""
    batch_id: str | None
    """the batch that the run belongs to; null: none"""
    holds: bool | None
    """whether every criterion of the verdict holds; null: no verdict"""
    figure: Figure | None
    """null: no result, or a run of an early version"""
    solver: Solver
    """the program that solved"""
    verdict: VerdictResult | None
    """the verdict of an answered design or check; null otherwise, and for runs of early versions"""
    spec: CrankDynamicsStudyRequest
    """the request as understood, with defaults filled in"""
    result: StudyResult | Infeasible | None
    """the result, or the diagnosis; null: not finished, or failed"""
    problem: ProblemDetails | None
    """why there is no answer (RFC 9457); null: there is one"""
    effects: list[EffectResult]
    """every effect with its state and its estimated influence"""
    accuracy: AccuracyResult | None
    """requested and estimated accuracy, and whether it was met; null: nothing was solved"""
    timing: dict[str, float]
    """seconds per step"""
    links: Links
    """addresses of the run and of what belongs to it"""
    progress: RunProgress | None
    """progress of a long run that is not finished"""


class CrankDynamicsAnalysisRun(TypedDict):
    """A run: verdict, request, result, effects, accuracy and timing. ``status`` describes only how the solve ended."""

    id: str
    """identifier of the run, part of its address"""
    kind: str
    """discriminator of the form, or the kind of design"""
    mode: Mode
    """design, check, analysis or accuracy"""
    status: RunStatus
    """state or outcome of the solve"""
    name: str
    """name"""
    created_at: str
    """when the run was requested, UTC"""
    spec_hash: str
    """SHA-256 of kind, mode and request, without the name"""
    cached: bool
    """whether the answer was taken from an earlier run of the same request by the same solver"""
    batch_id: str | None
    """the batch that the run belongs to; null: none"""
    holds: bool | None
    """whether every criterion of the verdict holds; null: no verdict"""
    figure: Figure | None
    """null: no result, or a run of an early version"""
    solver: Solver
    """the program that solved"""
    verdict: VerdictResult | None
    """the verdict of an answered design or check; null otherwise, and for runs of early versions"""
    spec: DynamicsRequest
    """the request as understood, with defaults filled in"""
    result: DynamicsResult | Infeasible | None
    """the result, or the diagnosis; null: not finished, or failed"""
    problem: ProblemDetails | None
    """why there is no answer (RFC 9457); null: there is one"""
    effects: list[EffectResult]
    """every effect with its state and its estimated influence"""
    accuracy: AccuracyResult | None
    """requested and estimated accuracy, and whether it was met; null: nothing was solved"""
    timing: dict[str, float]
    """seconds per step"""
    links: Links
    """addresses of the run and of what belongs to it"""
    progress: RunProgress | None
    """progress of a long run that is not finished"""


class CrankDynamicsMechanism(TypedDict):
    crank_radius_mm: float
    """r, crank radius; less than the rod's length"""
    rod_length_mm: float
    """L, wrist pin to crank pin"""
    speed_hz: float
    """revolutions per second"""
    offset_mm: NotRequired[float]
    """distance of the cylinder axis from the shaft, positive toward the side to which the crank turns from the top;
    angles then count from the crank parallel to the cylinder axis"""


class CrankDynamicsStudyRequest(TypedDict):
    """The case, the goal, and the time for measuring."""

    time_budget_s: NotRequired[float | None]
    """time that one solution may take; null: the recommendation goes by the accuracy of the spec"""
    study_budget_s: NotRequired[float]
    """time for the independent reference and the runs, without the tightest solution; a reference that takes longer
    is abandoned, levels for which no time is left are omitted"""
    spec: DynamicsRequest
    """a request of this kind"""


class CrankMassesAnalysisRun(TypedDict):
    """A run: verdict, request, result, effects, accuracy and timing. ``status`` describes only how the solve ended."""

    id: str
    """identifier of the run, part of its address"""
    kind: str
    """discriminator of the form, or the kind of design"""
    mode: Mode
    """design, check, analysis or accuracy"""
    status: RunStatus
    """state or outcome of the solve"""
    name: str
    """name"""
    created_at: str
    """when the run was requested, UTC"""
    spec_hash: str
    """SHA-256 of kind, mode and request, without the name"""
    cached: bool
    """whether the answer was taken from an earlier run of the same request by the same solver"""
    batch_id: str | None
    """the batch that the run belongs to; null: none"""
    holds: bool | None
    """whether every criterion of the verdict holds; null: no verdict"""
    figure: Figure | None
    """null: no result, or a run of an early version"""
    solver: Solver
    """the program that solved"""
    verdict: VerdictResult | None
    """the verdict of an answered design or check; null otherwise, and for runs of early versions"""
    spec: MassesRequest
    """the request as understood, with defaults filled in"""
    result: MassesResult | Infeasible | None
    """the result, or the diagnosis; null: not finished, or failed"""
    problem: ProblemDetails | None
    """why there is no answer (RFC 9457); null: there is one"""
    effects: list[EffectResult]
    """every effect with its state and its estimated influence"""
    accuracy: AccuracyResult | None
    """requested and estimated accuracy, and whether it was met; null: nothing was solved"""
    timing: dict[str, float]
    """seconds per step"""
    links: Links
    """addresses of the run and of what belongs to it"""
    progress: RunProgress | None
    """progress of a long run that is not finished"""


class CriterionResult(TypedDict):
    """A criterion: value and requirement."""

    name: str
    """name of the request's field if asked is true, else of the result"""
    label: str
    """label of the criterion"""
    sense: Literal["at_least", "at_most", "equal", "yes"]
    """relation between reached and required; yes: a condition that is 1 if true and 0 if false"""
    required: float
    """the required value"""
    reached: float | None
    """null: no load acts; if the criterion fails: unknown or unbounded"""
    unit: str
    """unit; empty: none"""
    margin: float | None
    """margin of safety: reached/required - 1 of a minimum, required/reached - 1 of a maximum; 0: fully used;
    negative: the criterion fails; null: no load acts, or unknown"""
    holds: bool
    """whether the requirement is met, within the requested accuracy and at most 1e-3"""
    asked: bool
    """true: required by the request; false: required of every such part"""


class CustomMaterial(TypedDict):
    elastic_modulus_gpa: float
    """elastic modulus, in GPa"""
    fatigue_limit_mpa: float
    """fatigue limit of a smooth specimen in alternating bending"""
    fatigue_reduction: float
    """K, fatigue reduction factor: notch, size and surface together"""
    mean_stress_sensitivity: float
    """psi, mean stress sensitivity of Serensen's criterion"""
    yield_strength_mpa: float
    """yield strength, in MPa"""
    density_kg_m3: float
    """density, in kg/m³"""
    poisson: NotRequired[float]
    """Poisson's ratio"""
    ultimate_strength_mpa: NotRequired[float | None]
    """tensile strength, for Goodman and Gerber"""
    loss_factor: NotRequired[float]
    """η, loss factor of the strip in its clamps: twice the damping ratio; 0: undamped"""


class CyclePoints(TypedDict):
    """The pressures used, for rod designs that reference this run as their load."""

    angle_deg: list[float]
    """angle, in °"""
    pressure_mpa: list[float]
    """pressure, in MPa"""


class Cylinder(TypedDict):
    bore_mm: float
    """bore, in mm"""
    clearance_volume_cm3: NotRequired[float]
    """volume at the top dead centre"""
    crankcase_pressure_mpa: NotRequired[float]
    """crankcase pressure, below the piston"""
    strokes: Literal[2, 4]
    """strokes per cycle"""

Detail = Literal["scalars", "full"]


class Dimensions(TypedDict):
    b_mm: float
    """b, width"""
    h_mm: float
    """h, thickness in the plane of bending"""
    l_mm: float
    """l, free length; at most the rod's length"""


class Drive(TypedDict):
    """A motor with a linear torque-speed curve, and the inertia it drives; activates the effect impact_dynamics."""

    stall_torque_nm: NotRequired[float | None]
    """stall torque of the motor, at the crank"""
    free_speed_hz: NotRequired[float | None]
    """no-load speed at the crank, in revolutions per second"""
    crank_inertia_kg_m2: NotRequired[float | None]
    """moment of inertia of crank and flywheel together"""


class DynamicsRequest(TypedDict):
    """A crank mechanism, its masses, and the pressure that drives it."""

    name: NotRequired[str]
    """a name for display; it does not affect the result"""
    effects: NotRequired[Literal["auto", "all"] | EffectChoice]
    """auto, all, or a choice with include and exclude"""
    effect_tolerance: NotRequired[float]
    """maximum relative change of the main results that all omitted effects may cause together"""
    accuracy: NotRequired[float]
    """requested relative numerical accuracy"""
    mechanism: CrankDynamicsMechanism
    """crank, rod and speed"""
    cylinder: Cylinder
    """bore, clearance volume, crankcase pressure and strokes"""
    pressure: TablePressure | IndicatorPressure
    """source of the gas pressure"""
    masses: Masses
    """piston, rod and crank"""
    engine: NotRequired[Engine | None]
    """several cylinders on one shaft; null: one cylinder"""
    series_angles: NotRequired[int]
    """number of equally spaced angles in the series"""


class DynamicsResult(TypedDict):
    """Forces over the cycle; top-level torque and power are of one cylinder, the irregularity is the shaft's."""

    reciprocating_mass_kg: float
    """reciprocating mass, in kg"""
    rotating_mass_kg: float
    """rotating mass, in kg"""
    rod_mass_at_pin_kg: float
    """rod mass at pin, in kg"""
    rod_mass_at_crank_kg: float
    """rod mass at crank, in kg"""
    inertia_defect_kg_m2: float
    """inertia defect, in kg·m²"""
    mean_torque_nm: float
    """mean torque, in N·m"""
    indicated_power_w: float
    """indicated power, in W"""
    irregularity: float | None
    """(maximum - minimum speed)/mean speed with the given inertia; null: no inertia given"""
    torque_irregularity: float | None
    """(maximum - minimum torque)/mean torque; null: the mean torque is zero"""
    work_fluctuation_j: float
    """work between the minimum and the maximum of the speed"""
    shaft_inertia_kg_m2: float
    """shaft inertia, in kg·m²"""
    flywheel_inertia_wanted_kg_m2: float | None
    """null: no coefficient of speed fluctuation was requested"""
    brix_error: float
    """maximum error of Brix's displacement, relative to the crank radius"""
    two_harmonic_error: float
    """maximum error of the two-harmonic acceleration, relative to the maximum acceleration"""
    brix_pressure_error_mpa: float | None
    """brix pressure error, in MPa"""
    gas_force_max_n: float
    """gas force max, in N"""
    rod_compression_max_n: float
    """rod compression max, in N"""
    rod_tension_max_n: float
    """negative where the rod is never in tension"""
    side_force_max_n: float
    """side force max, in N"""
    wrist_pin_load_max_n: float
    """wrist pin load max, in N"""
    crank_pin_load_max_n: float
    """crank pin load max, in N"""
    main_bearing_load_max_n: float
    """main bearing load max, in N"""
    stroke_mm: float
    """stroke, in mm"""
    upper_dead_centre_deg: float
    """upper dead centre, in °"""
    lower_dead_centre_deg: float
    """lower dead centre, in °"""
    worst: list[WorstInstant]
    """instants of the maximum loads"""
    engine: EngineResult | None
    """several cylinders on one shaft; null: one cylinder"""
    dead_centre_jumps: list[Jump]
    """jumps of the pressure at dead centres"""
    repairs: list[RepairDone]
    """changes to the points; empty unless requested"""
    cycle: CyclePoints | None
    """pressures of a two-stroke cycle; null: a four-stroke cycle, which cannot load a rod"""
    series: Series
    """forces over the crank angle"""
    warnings: list[str]
    """warnings about the results"""


class EffectChoice(TypedDict):
    """Effects forced on or off; all others follow their influence."""

    include: NotRequired[list[str]]
    """names of effects that must run"""
    exclude: NotRequired[list[str]]
    """names of effects that must not run"""


class EffectCostResult(TypedDict):
    """Influence and cost of an effect; null if there is no answer without it or the time ran out."""

    name: str
    """name"""
    active: bool
    """whether the effect ran in the request itself"""
    change: float | None
    """maximum relative change of the main results if the effect is left out"""
    brings: list[str]
    """main results that exist only with the effect"""
    time_with_s: float | None
    """time with, in s"""
    time_without_s: float | None
    """time without, in s"""
    runs: int
    """number of timed runs"""


class EffectInfo(TypedDict):
    """An effect of the kind."""

    name: str
    """name"""
    summary: str
    """summary"""
    measure: str
    """how the influence is estimated before solving"""


class EffectResult(TypedDict):
    """An entry of the effects manifest."""

    name: str
    """name of the effect"""
    state: Literal["active", "skipped"]
    """active or skipped"""
    influence: float
    """estimated relative change of the main results if the effect is left out; 1e9: unknown"""
    why: str
    """why it ran or was skipped"""


class Engine(TypedDict):
    """Several like cylinders on one shaft."""

    cylinders: int
    """number of cylinders"""
    phases_deg: list[float]
    """crank angle by which each cylinder's cycle follows the first one's"""
    bank_deg: NotRequired[float | list[float]]
    """V angle, with cylinders alternately left and right; or the direction of every cylinder"""
    positions_mm: NotRequired[list[float] | None]
    """distance between cylinders along the shaft; null: couples are not computed"""
    flywheel_inertia_kg_m2: NotRequired[float]
    """flywheel inertia, in kg·m²"""
    wanted_irregularity: NotRequired[float | None]
    """coefficient of speed fluctuation, (maximum - minimum speed)/mean speed; the flywheel that it requires is
    computed"""


class EngineResult(TypedDict):
    """Results of the whole engine."""

    mean_torque_nm: float
    """mean torque, in N·m"""
    torque_max_nm: float
    """torque max, in N·m"""
    torque_min_nm: float
    """torque min, in N·m"""
    indicated_power_w: float
    """indicated power, in W"""
    reciprocating_unbalance: list[Unbalance]
    """unbalanced inertia forces and couples of the reciprocating masses, by order"""
    rotating_unbalance_n: float
    """rotating unbalance, in N"""
    rotating_couple_nm: float | None
    """rotating couple, in N·m"""
    shared_crank_pin_load_max_n: float | None
    """shared crank pin load max, in N"""
    shared_main_bearing_load_max_n: float | None
    """shared main bearing load max, in N"""


class EstimateRequest(TypedDict):
    """Constructive masses of an existing engine, scaled to a bore."""

    name: NotRequired[str]
    """a name for display; it does not affect the result"""
    effects: NotRequired[Literal["auto", "all"] | EffectChoice]
    """auto, all, or a choice with include and exclude"""
    effect_tolerance: NotRequired[float]
    """maximum relative change of the main results that all omitted effects may cause together"""
    accuracy: NotRequired[float]
    """requested relative numerical accuracy"""
    method: Literal["estimate"]
    """how the masses are determined"""
    bore_mm: float
    """bore, in mm"""
    piston_kg_m2: float
    """mass of the piston group per piston area"""
    rod_kg_m2: float
    """mass of the rod per piston area"""
    uncertainty: NotRequired[EstimateUncertainty]
    """standard uncertainties of what was measured"""


class EstimateUncertainty(TypedDict):
    """Standard uncertainties of what was assumed."""

    bore_mm: NotRequired[float]
    """bore, in mm"""
    piston_kg_m2: NotRequired[float]
    """piston, in kg·m²"""
    rod_kg_m2: NotRequired[float]
    """rod, in kg·m²"""


class ExportInfo(TypedDict):
    """An export format of the kind's runs."""

    name: str
    """name"""
    title: str
    """display title"""
    media_type: str
    """media type of the file"""
    extension: str
    """file name extension"""
    tools: list[str]
    """values that ?for= accepts, for the parameters export; empty for all others"""
    available: bool
    """false: a required extra is not installed"""


class FieldInfo(TypedDict):
    """A field of a request. Limits are null if there are none."""

    path: str
    """dotted names; [] for the items of a list"""
    label: str
    """display name"""
    unit: str
    """unit; empty: none"""
    type: str
    """number, integer, string, boolean, choice, list, or form (a choice between objects, which is not a field
    itself)"""
    required: bool
    """whether its object requires the field; of a chosen form only its own fields are required"""
    nullable: bool
    """whether null is accepted"""
    default: Any
    """null: no limit"""
    minimum: float | None
    """lower bound; null: none"""
    maximum: float | None
    """upper bound; null: none"""
    exclusive_minimum: bool
    """lower bound, itself excluded; null: none"""
    exclusive_maximum: bool
    """upper bound, itself excluded; null: none"""
    items: str | None
    """lists only: the type of the items, to which the limits apply"""
    least_items: int | None
    """minimum number of entries; null: none"""
    most: int | None
    """number of characters of a string, or of items of a list"""
    choices: list[str | float] | None
    """the accepted words; null: any"""
    when: str
    """the forms in which the field exists, such as load.kind=schmidt, or material=custommaterial where the fields
    alone identify a form; empty: in every form"""
    help: str
    """what the field means"""


class Figure(TypedDict):
    """The headline number of a run: the objective of a design, a part's mass, an engine's power."""

    name: str
    """name of the number, as in the result"""
    value: float
    """value"""


class FlexibleRodAccuracyRun(TypedDict):
    """A run: verdict, request, result, effects, accuracy and timing. ``status`` describes only how the solve ended."""

    id: str
    """identifier of the run, part of its address"""
    kind: str
    """discriminator of the form, or the kind of design"""
    mode: Mode
    """design, check, analysis or accuracy"""
    status: RunStatus
    """state or outcome of the solve"""
    name: str
    """name"""
    created_at: str
    """when the run was requested, UTC"""
    spec_hash: str
    """SHA-256 of kind, mode and request, without the name"""
    cached: bool
    """whether the answer was taken from an earlier run of the same request by the same solver"""
    batch_id: str | None
    """the batch that the run belongs to; null: none"""
    holds: bool | None
    """whether every criterion of the verdict holds; null: no verdict"""
    figure: Figure | None
    """null: no result, or a run of an early version"""
    solver: Solver
    """the program that solved"""
    verdict: VerdictResult | None
    """the verdict of an answered design or check; null otherwise, and for runs of early versions"""
    spec: FlexibleRodStudyRequest
    """the request as understood, with defaults filled in"""
    result: StudyResult | Infeasible | None
    """the result, or the diagnosis; null: not finished, or failed"""
    problem: ProblemDetails | None
    """why there is no answer (RFC 9457); null: there is one"""
    effects: list[EffectResult]
    """every effect with its state and its estimated influence"""
    accuracy: AccuracyResult | None
    """requested and estimated accuracy, and whether it was met; null: nothing was solved"""
    timing: dict[str, float]
    """seconds per step"""
    links: Links
    """addresses of the run and of what belongs to it"""
    progress: RunProgress | None
    """progress of a long run that is not finished"""


class FlexibleRodCheckRequest(TypedDict):
    """A check: given dimensions in a machine."""

    name: NotRequired[str]
    """a name for display; it does not affect the result"""
    effects: NotRequired[Literal["auto", "all"] | EffectChoice]
    """auto, all, or a choice with include and exclude"""
    effect_tolerance: NotRequired[float]
    """maximum relative change of the main results that all omitted effects may cause together"""
    accuracy: NotRequired[float]
    """requested relative numerical accuracy"""
    mechanism: FlexibleRodMechanism
    """crank, rod and speed"""
    piston: Piston
    """diameter, skirt, mass and friction"""
    load: SchmidtLoad | TableLoad | ConstantLoad | IndicatorLoad | RunLoad
    """load on the part"""
    material: CustomMaterial | CatalogueMaterial
    """strengths, stiffness and density, or a name of the catalogue"""
    fatigue_criterion: NotRequired[Literal["serensen", "goodman", "gerber", "soderberg", "fkm"]]
    """fatigue criterion"""
    dimensions: Dimensions
    """width, thickness and free length of the strip"""


class FlexibleRodCheckRun(TypedDict):
    """A run: verdict, request, result, effects, accuracy and timing. ``status`` describes only how the solve ended."""

    id: str
    """identifier of the run, part of its address"""
    kind: str
    """discriminator of the form, or the kind of design"""
    mode: Mode
    """design, check, analysis or accuracy"""
    status: RunStatus
    """state or outcome of the solve"""
    name: str
    """name"""
    created_at: str
    """when the run was requested, UTC"""
    spec_hash: str
    """SHA-256 of kind, mode and request, without the name"""
    cached: bool
    """whether the answer was taken from an earlier run of the same request by the same solver"""
    batch_id: str | None
    """the batch that the run belongs to; null: none"""
    holds: bool | None
    """whether every criterion of the verdict holds; null: no verdict"""
    figure: Figure | None
    """null: no result, or a run of an early version"""
    solver: Solver
    """the program that solved"""
    verdict: VerdictResult | None
    """the verdict of an answered design or check; null otherwise, and for runs of early versions"""
    spec: FlexibleRodCheckRequest
    """the request as understood, with defaults filled in"""
    result: RodResult | Infeasible | None
    """the result, or the diagnosis; null: not finished, or failed"""
    problem: ProblemDetails | None
    """why there is no answer (RFC 9457); null: there is one"""
    effects: list[EffectResult]
    """every effect with its state and its estimated influence"""
    accuracy: AccuracyResult | None
    """requested and estimated accuracy, and whether it was met; null: nothing was solved"""
    timing: dict[str, float]
    """seconds per step"""
    links: Links
    """addresses of the run and of what belongs to it"""
    progress: RunProgress | None
    """progress of a long run that is not finished"""


class FlexibleRodDesignRequest(TypedDict):
    """A design: requirements, bounds and objective."""

    time_budget_s: NotRequired[float | None]
    """wall-clock limit of this design, at most the limit of the service; null: that limit. A kind that improves its
    design iteratively answers with the best one so far that meets every requirement, with the remaining gap and
    accuracy.met false; any other run that does not finish in time fails"""
    name: NotRequired[str]
    """a name for display; it does not affect the result"""
    effects: NotRequired[Literal["auto", "all"] | EffectChoice]
    """auto, all, or a choice with include and exclude"""
    effect_tolerance: NotRequired[float]
    """maximum relative change of the main results that all omitted effects may cause together"""
    accuracy: NotRequired[float]
    """requested relative numerical accuracy"""
    mechanism: FlexibleRodMechanism
    """crank, rod and speed"""
    piston: Piston
    """diameter, skirt, mass and friction"""
    load: SchmidtLoad | TableLoad | ConstantLoad | IndicatorLoad | RunLoad
    """load on the part"""
    material: CustomMaterial | CatalogueMaterial
    """strengths, stiffness and density, or a name of the catalogue"""
    fatigue_criterion: NotRequired[Literal["serensen", "goodman", "gerber", "soderberg", "fkm"]]
    """fatigue criterion"""
    requirements: NotRequired[Requirements]
    """minimum safety factors and maximum loads"""
    bounds: RodBounds
    """minimum and maximum dimensions"""
    stock_h_mm: NotRequired[list[float] | None]
    """available thicknesses; null: any thickness"""
    step_mm: NotRequired[Steps]
    """steps to whose multiples the dimensions are rounded, in mm"""
    objective: NotRequired[Literal["mass", "friction_power", "contact_pressure", "side_force", "fatigue_safety", "stability_safety"]]
    """the quantity that a design minimises or maximises, or its value at this point"""


class FlexibleRodDesignResult(TypedDict):
    """The optimal strip, its active constraints, and the certificate."""

    dimensions: Dimensions
    """width, thickness and free length of the strip"""
    fatigue_safety: float | None
    """safety factor against fatigue; null: no alternating stress, or no stresses exist"""
    stability_safety: float | None
    """critical force over the maximum compression; null: no compression"""
    yield_safety: float | None
    """yield strength over the maximum stress; null: no stresses exist"""
    critical_force_n: float
    """critical force, in N"""
    buckles_sideways: bool
    """whether the strip is less stiff across the crank's plane than in it and buckles out of plane"""
    axial_force_min_n: float
    """axial force min, in N"""
    axial_force_max_n: float
    """axial force max, in N"""
    stress_amplitude_mpa: float | None
    """stress amplitude, in MPa"""
    stress_mean_mpa: float | None
    """stress mean, in MPa"""
    worst_section_mm: float | None
    """worst section, in mm"""
    worst_fibre: int | None
    """governing side of the strip: 1 at +h/2, -1 at -h/2"""
    side_force_max_n: float | None
    """side force max, in N"""
    clamp_moment_max_nmm: float | None
    """clamp moment max, in N·mm"""
    contact_pressure_max_mpa: float | None
    """contact pressure max, in MPa"""
    friction_power_w: float | None
    """friction power, in W"""
    deflection_ratio: float | None
    """maximum deflection over the free length; null: no equilibrium shape exists"""
    natural_frequency_hz: float
    """natural frequency, in Hz"""
    mass_g: float
    """mass, in g"""
    fatigue_criterion: str
    """fatigue criterion"""
    repairs: list[RepairDone]
    """repairs of the load's points; empty unless requested"""
    warnings: list[str]
    """warnings about the results"""
    objective: str
    """the quantity that a design minimises or maximises, or its value at this point"""
    active_constraints: list[Active]
    """requirements and bounds that are active at the design, with their sensitivities"""
    certificate: CertificateResult | None
    """proof that the answer is optimal, or that none exists; null: not proven"""


class FlexibleRodDesignRun(TypedDict):
    """A run: verdict, request, result, effects, accuracy and timing. ``status`` describes only how the solve ended."""

    id: str
    """identifier of the run, part of its address"""
    kind: str
    """discriminator of the form, or the kind of design"""
    mode: Mode
    """design, check, analysis or accuracy"""
    status: RunStatus
    """state or outcome of the solve"""
    name: str
    """name"""
    created_at: str
    """when the run was requested, UTC"""
    spec_hash: str
    """SHA-256 of kind, mode and request, without the name"""
    cached: bool
    """whether the answer was taken from an earlier run of the same request by the same solver"""
    batch_id: str | None
    """the batch that the run belongs to; null: none"""
    holds: bool | None
    """whether every criterion of the verdict holds; null: no verdict"""
    figure: Figure | None
    """null: no result, or a run of an early version"""
    solver: Solver
    """the program that solved"""
    verdict: VerdictResult | None
    """the verdict of an answered design or check; null otherwise, and for runs of early versions"""
    spec: FlexibleRodDesignRequest
    """the request as understood, with defaults filled in"""
    result: FlexibleRodDesignResult | Infeasible | None
    """the result, or the diagnosis; null: not finished, or failed"""
    problem: ProblemDetails | None
    """why there is no answer (RFC 9457); null: there is one"""
    effects: list[EffectResult]
    """every effect with its state and its estimated influence"""
    accuracy: AccuracyResult | None
    """requested and estimated accuracy, and whether it was met; null: nothing was solved"""
    timing: dict[str, float]
    """seconds per step"""
    links: Links
    """addresses of the run and of what belongs to it"""
    progress: RunProgress | None
    """progress of a long run that is not finished"""


class FlexibleRodMechanism(TypedDict):
    crank_radius_mm: float
    """r, crank radius; less than the rod's length"""
    rod_length_mm: float
    """L, distance from the clamp in the piston to the crank pin"""
    speed_hz: float
    """revolutions per second"""


class FlexibleRodStudyRequest(TypedDict):
    """The case, the goal, and the time for measuring."""

    time_budget_s: NotRequired[float | None]
    """time that one solution may take; null: the recommendation goes by the accuracy of the spec"""
    study_budget_s: NotRequired[float]
    """time for the independent reference and the runs, without the tightest solution; a reference that takes longer
    is abandoned, levels for which no time is left are omitted"""
    spec: FlexibleRodDesignRequest | FlexibleRodCheckRequest
    """a design request or a check request of this kind"""

Format = Literal["ndjson", "csv", "parquet"]


class FrontPointResult(TypedDict):
    """A linkage on the front: no other is better in both quantities, up to the gap."""

    objective: float
    """the quantity that a design minimises or maximises, or its value at this point"""
    against: float
    """the quantity traded against the objective"""
    gap: float
    """relative distance between the point and the proven bound"""
    type: str
    """type of change-point linkage, or a URI of the kind of problem"""
    lengths_mm: Lengths
    """lengths of the four links, in mm; null: only ratios were given"""
    box_area_mm2: float
    """box area, in mm²"""
    longest_link_mm: float
    """longest link, in mm"""
    enclosing_radius_mm: float
    """enclosing radius, in mm"""
    peak_torque_nm: float | None
    """peak torque, in N·m"""
    pin_force_n: float | None
    """pin force, in N"""


class FrontRequest(TypedDict):
    """A Pareto front: the optimal objective for limits on another quantity, from its minimum up."""

    against: NotRequired[Literal["none", "longest_link", "enclosing_radius", "pin_force"]]
    """the quantity traded against the objective"""
    points: NotRequired[float]
    """the points, or their number"""


class FrontResult(TypedDict):
    """Trade-off of the objective against another quantity, in increasing order of that quantity."""

    objective: str
    """the quantity that a design minimises or maximises, or its value at this point"""
    objective_unit: str
    """unit of the objective"""
    against: str
    """the quantity traded against the objective"""
    against_unit: str
    """unit of the other quantity"""
    points: list[FrontPointResult]
    """the points, or their number"""


class Geometry(TypedDict):
    outer_diameter_mm: NotRequired[float | None]
    """D, outer diameter; omitted in the design of a bushing, which determines it"""
    boss_length_mm: float
    """a, length in each boss of the piston"""
    small_end_length_mm: float
    """b, length in the rod's small end"""
    gap_mm: NotRequired[float]
    """δ, gap between small end and boss"""


class ImpactLinkageAccuracyRun(TypedDict):
    """A run: verdict, request, result, effects, accuracy and timing. ``status`` describes only how the solve ended."""

    id: str
    """identifier of the run, part of its address"""
    kind: str
    """discriminator of the form, or the kind of design"""
    mode: Mode
    """design, check, analysis or accuracy"""
    status: RunStatus
    """state or outcome of the solve"""
    name: str
    """name"""
    created_at: str
    """when the run was requested, UTC"""
    spec_hash: str
    """SHA-256 of kind, mode and request, without the name"""
    cached: bool
    """whether the answer was taken from an earlier run of the same request by the same solver"""
    batch_id: str | None
    """the batch that the run belongs to; null: none"""
    holds: bool | None
    """whether every criterion of the verdict holds; null: no verdict"""
    figure: Figure | None
    """null: no result, or a run of an early version"""
    solver: Solver
    """the program that solved"""
    verdict: VerdictResult | None
    """the verdict of an answered design or check; null otherwise, and for runs of early versions"""
    spec: ImpactLinkageStudyRequest
    """the request as understood, with defaults filled in"""
    result: StudyResult | Infeasible | None
    """the result, or the diagnosis; null: not finished, or failed"""
    problem: ProblemDetails | None
    """why there is no answer (RFC 9457); null: there is one"""
    effects: list[EffectResult]
    """every effect with its state and its estimated influence"""
    accuracy: AccuracyResult | None
    """requested and estimated accuracy, and whether it was met; null: nothing was solved"""
    timing: dict[str, float]
    """seconds per step"""
    links: Links
    """addresses of the run and of what belongs to it"""
    progress: RunProgress | None
    """progress of a long run that is not finished"""


class ImpactLinkageCheckRequest(TypedDict):
    """A check of a linkage given by type and free ratio, then with R_k = R, or by its four lengths. Results that
    require a missing frequency, speed or energy are null."""

    name: NotRequired[str]
    """a name for display; it does not affect the result"""
    effects: NotRequired[Literal["auto", "all"] | EffectChoice]
    """auto, all, or a choice with include and exclude"""
    effect_tolerance: NotRequired[float]
    """maximum relative change of the main results that all omitted effects may cause together"""
    accuracy: NotRequired[float]
    """requested relative numerical accuracy"""
    restitution: float | RestitutionRange
    """physical coefficient of restitution of the impact"""
    blow_frequency_hz: NotRequired[float | None]
    """blows per second: one per revolution of the crank"""
    impact_speed_m_s: NotRequired[float | None]
    """speed of the tool just before the blow"""
    impact_energy_j: NotRequired[float | None]
    """kinetic energy of rocker and tool just before the blow"""
    tool_radius_mm: NotRequired[float | None]
    """null: the rocker's length"""
    limits: NotRequired[LinkageLimits]
    """further limits"""
    drive: NotRequired[Drive | None]
    """motor and inertia; null: the crank turns at constant speed"""
    coupler_stiffness_n_m: NotRequired[float | None]
    """stiffness of the coupler; activates the effect coupler_elasticity"""
    length_tolerance_mm: NotRequired[float | None]
    """tolerance of each length; activates the effect tolerances"""
    type: NotRequired[Literal["largest_coupler", "largest_rocker", "largest_base"] | None]
    """null: recognised from the lengths"""
    ratios: NotRequired[RatioGiven | None]
    """links over crank"""
    lengths_mm: NotRequired[LinkLengths | None]
    """lengths of the four links, in mm; null: only ratios were given"""


class ImpactLinkageCheckRun(TypedDict):
    """A run: verdict, request, result, effects, accuracy and timing. ``status`` describes only how the solve ended."""

    id: str
    """identifier of the run, part of its address"""
    kind: str
    """discriminator of the form, or the kind of design"""
    mode: Mode
    """design, check, analysis or accuracy"""
    status: RunStatus
    """state or outcome of the solve"""
    name: str
    """name"""
    created_at: str
    """when the run was requested, UTC"""
    spec_hash: str
    """SHA-256 of kind, mode and request, without the name"""
    cached: bool
    """whether the answer was taken from an earlier run of the same request by the same solver"""
    batch_id: str | None
    """the batch that the run belongs to; null: none"""
    holds: bool | None
    """whether every criterion of the verdict holds; null: no verdict"""
    figure: Figure | None
    """null: no result, or a run of an early version"""
    solver: Solver
    """the program that solved"""
    verdict: VerdictResult | None
    """the verdict of an answered design or check; null otherwise, and for runs of early versions"""
    spec: ImpactLinkageCheckRequest
    """the request as understood, with defaults filled in"""
    result: LinkageResult | Infeasible | None
    """the result, or the diagnosis; null: not finished, or failed"""
    problem: ProblemDetails | None
    """why there is no answer (RFC 9457); null: there is one"""
    effects: list[EffectResult]
    """every effect with its state and its estimated influence"""
    accuracy: AccuracyResult | None
    """requested and estimated accuracy, and whether it was met; null: nothing was solved"""
    timing: dict[str, float]
    """seconds per step"""
    links: Links
    """addresses of the run and of what belongs to it"""
    progress: RunProgress | None
    """progress of a long run that is not finished"""


class ImpactLinkageDesignRequest(TypedDict):
    """A design: the best linkage over the allowed types."""

    time_budget_s: NotRequired[float | None]
    """wall-clock limit of this design, at most the limit of the service; null: that limit. A kind that improves its
    design iteratively answers with the best one so far that meets every requirement, with the remaining gap and
    accuracy.met false; any other run that does not finish in time fails"""
    name: NotRequired[str]
    """a name for display; it does not affect the result"""
    effects: NotRequired[Literal["auto", "all"] | EffectChoice]
    """auto, all, or a choice with include and exclude"""
    effect_tolerance: NotRequired[float]
    """maximum relative change of the main results that all omitted effects may cause together"""
    accuracy: NotRequired[float]
    """requested relative numerical accuracy"""
    restitution: float | RestitutionRange
    """physical coefficient of restitution of the impact"""
    blow_frequency_hz: NotRequired[float | None]
    """blows per second: one per revolution of the crank"""
    impact_speed_m_s: NotRequired[float | None]
    """speed of the tool just before the blow"""
    impact_energy_j: NotRequired[float | None]
    """kinetic energy of rocker and tool just before the blow"""
    tool_radius_mm: NotRequired[float | None]
    """null: the rocker's length"""
    limits: NotRequired[LinkageLimits]
    """further limits"""
    drive: NotRequired[Drive | None]
    """motor and inertia; null: the crank turns at constant speed"""
    coupler_stiffness_n_m: NotRequired[float | None]
    """stiffness of the coupler; activates the effect coupler_elasticity"""
    length_tolerance_mm: NotRequired[float | None]
    """tolerance of each length; activates the effect tolerances"""
    types: NotRequired[list[Literal["largest_coupler", "largest_rocker", "largest_base"]]]
    """allowed types of linkage"""
    objective: NotRequired[Literal["box_area", "longest_link", "enclosing_radius", "peak_torque", "pin_force", "impact_speed", "blow_frequency"]]
    """the quantity that a design minimises or maximises, or its value at this point"""
    front: NotRequired[FrontRequest]
    """trade-off with another quantity; against none: the best linkage alone"""


class ImpactLinkageDesignResult(TypedDict):
    """The optimal linkage, its active limits, the best of every allowed type, and the certificate."""

    type: str
    """type of change-point linkage, or a URI of the kind of problem"""
    lengths_mm: Lengths | None
    """lengths of the four links, in mm; null: only ratios were given"""
    ratios: Ratios
    """links over crank"""
    closure: ClosureResult
    """closure error of the lengths"""
    rotatable: bool
    """whether the crank can make full turns"""
    confined_deg: float | None
    """a crank that cannot make a full turn stays within ± this angle of the blow"""
    u31_start: float | None
    """magnitude of the transfer function just after the blow"""
    u31_end: float | None
    """magnitude of the transfer function just before the blow"""
    u31_max: float | None
    """maximum magnitude of the transfer function over the cycle"""
    kinematic_restitution: float | None
    """R_k, the restitution without a jump of crank speed; null: the linkage cannot strike"""
    restitution_mismatch: float | None
    """maximum |R - R_k| over the requested range"""
    rocker_swing_deg: float | None
    """rocker swing, in °"""
    transmission_angle_deg: float | None
    """transmission angle between coupler and rocker in mid-cycle"""
    blow_frequency_hz: float | None
    """blow frequency, in Hz"""
    impact_speed_m_s: float | None
    """impact speed, in m/s"""
    longest_link_mm: float | None
    """longest link, in mm"""
    box_mm: SweptBox | None
    """box, in mm"""
    box_area_mm2: float | None
    """box area, in mm²"""
    enclosing_radius_mm: float | None
    """enclosing radius, in mm"""
    peak_torque_nm: float | None
    """maximum torque at the crank, from the rocker's inertia alone"""
    peak_torque_at_deg: float | None
    """peak torque at, in °"""
    pin_force_n: float | None
    """maximum force along the coupler, from the rocker's inertia alone"""
    pin_force_at_deg: float | None
    """pin force at, in °"""
    coupler_peak_n: float | None
    """maximum force after a blow with mismatched restitution, from the coupler's elasticity"""
    window: WindowResult | None
    """effect of the closure error on the blow; null: the lengths close"""
    restitution_error: float | None
    """relative error of the restitution if the lengths are off by their tolerance"""
    tolerance_window: WindowResult | None
    """effect of length tolerances on the blow"""
    running_frequency_hz: float | None
    """blows per second in steady state; needs the drive"""
    running_speed_m_s: float | None
    """running speed, in m/s"""
    irregularity: float | None
    """coefficient of speed fluctuation of the crank, (maximum - minimum)/mean speed"""
    crank_speed_jump: float | None
    """relative jump of the crank's speed at the blow"""
    motor_power_w: float | None
    """motor power, in W"""
    transfer: list[Sample]
    """transfer function u31 over the crank angle"""
    warnings: list[str]
    """warnings about the results"""
    objective: str
    """the quantity that a design minimises or maximises, or its value at this point"""
    value: float
    """value"""
    value_unit: str
    """unit of the value"""
    active_limits: list[str]
    """names of the active limits"""
    alternatives: list[AlternativeResult]
    """the best linkage of every allowed type, or the reason why there is none"""
    front: FrontResult | None
    """trade-off of the objective against another quantity; null: not requested"""
    certificate: CertificateResult | None
    """proof that the answer is optimal, or that none exists; null: not proven"""


class ImpactLinkageDesignRun(TypedDict):
    """A run: verdict, request, result, effects, accuracy and timing. ``status`` describes only how the solve ended."""

    id: str
    """identifier of the run, part of its address"""
    kind: str
    """discriminator of the form, or the kind of design"""
    mode: Mode
    """design, check, analysis or accuracy"""
    status: RunStatus
    """state or outcome of the solve"""
    name: str
    """name"""
    created_at: str
    """when the run was requested, UTC"""
    spec_hash: str
    """SHA-256 of kind, mode and request, without the name"""
    cached: bool
    """whether the answer was taken from an earlier run of the same request by the same solver"""
    batch_id: str | None
    """the batch that the run belongs to; null: none"""
    holds: bool | None
    """whether every criterion of the verdict holds; null: no verdict"""
    figure: Figure | None
    """null: no result, or a run of an early version"""
    solver: Solver
    """the program that solved"""
    verdict: VerdictResult | None
    """the verdict of an answered design or check; null otherwise, and for runs of early versions"""
    spec: ImpactLinkageDesignRequest
    """the request as understood, with defaults filled in"""
    result: ImpactLinkageDesignResult | Infeasible | None
    """the result, or the diagnosis; null: not finished, or failed"""
    problem: ProblemDetails | None
    """why there is no answer (RFC 9457); null: there is one"""
    effects: list[EffectResult]
    """every effect with its state and its estimated influence"""
    accuracy: AccuracyResult | None
    """requested and estimated accuracy, and whether it was met; null: nothing was solved"""
    timing: dict[str, float]
    """seconds per step"""
    links: Links
    """addresses of the run and of what belongs to it"""
    progress: RunProgress | None
    """progress of a long run that is not finished"""


class ImpactLinkageStudyRequest(TypedDict):
    """The case, the goal, and the time for measuring."""

    time_budget_s: NotRequired[float | None]
    """time that one solution may take; null: the recommendation goes by the accuracy of the spec"""
    study_budget_s: NotRequired[float]
    """time for the independent reference and the runs, without the tightest solution; a reference that takes longer
    is abandoned, levels for which no time is left are omitted"""
    spec: ImpactLinkageDesignRequest | ImpactLinkageCheckRequest
    """a design request or a check request of this kind"""


class IndicatorLoad(TypedDict):
    """An indicator diagram of a two-stroke cycle for the piston's own bore, unrolled with the machine's kinematics."""

    kind: Literal["indicator"]
    """discriminator of the form, or the kind of design"""
    strokes: list[Stroke]
    """four strokes: intake, compression, expansion, exhaust; two strokes: expansion, compression"""
    repair: NotRequired[bool]
    """repair faulty points and report each repair"""
    clearance_volume_cm3: NotRequired[float]
    """volume at the top dead centre"""
    back_pressure_mpa: NotRequired[float | None]
    """null: the mean of the cycle"""


class IndicatorPressure(TypedDict):
    """An indicator diagram of the cylinder."""

    kind: Literal["indicator"]
    """discriminator of the form, or the kind of design"""
    strokes: list[Stroke]
    """four strokes: intake, compression, expansion, exhaust; two strokes: expansion, compression"""
    repair: NotRequired[bool]
    """repair faulty points and report each repair"""


class Infeasible(TypedDict):
    """Diagnosis of an infeasible design."""

    diagnosis: list[ShortfallResult]
    """requirements that cannot be met, the distance of the best design from them, and what would help"""
    warnings: NotRequired[list[str]]
    """warnings about the diagnosis"""
    certificate: NotRequired[CertificateResult | None]
    """proof that the answer is optimal, or that none exists; null: not proven"""
    repairs: NotRequired[list[RepairDone]]
    """repairs of the request's points"""


class InfeasibleResult(TypedDict):
    """Why no pin of this outer diameter is feasible, and what would be."""

    diagnosis: list[ShortfallResult]
    """requirements that cannot be met, the distance of the best design from them, and what would help"""
    warnings: NotRequired[list[str]]
    """warnings about the diagnosis"""
    force_limit_n: float | None
    """force limit, in N"""
    infeasible_from_mm: float | None
    """infeasible from, in mm"""
    infeasible_to_mm: float | None
    """infeasible to, in mm"""
    least_outer_diameter_mm: float | None
    """with all else equal; null: no diameter suffices"""
    certificate: NotRequired[CertificateResult | None]
    """proof that the answer is optimal, or that none exists; null: not proven"""


class Jump(TypedDict):
    angle_deg: float
    """angle, in °"""
    jump_mpa: float
    """pressure just after the dead centre minus that just before it"""


class KindInfo(TypedDict):
    """Everything about a kind."""

    kind: str
    """discriminator of the form, or the kind of design"""
    title: str
    """display title"""
    summary: str
    """summary"""
    modes: list[Mode]
    """modes of the kind"""
    links: dict[str, str]
    """addresses of the run and of what belongs to it"""
    objectives: list[str]
    """objectives of a design; empty if there is only one"""
    effects: list[EffectInfo]
    """every effect with its state and its estimated influence"""
    exports: list[ExportInfo]
    """URLs of the run's exports, by name"""
    requests: list[ModeInfo]
    """requests by mode"""


class KindLine(TypedDict):
    """A kind in the listing."""

    kind: str
    """discriminator of the form, or the kind of design"""
    title: str
    """display title"""
    summary: str
    """summary"""
    modes: list[Mode]
    """modes of the kind"""
    links: dict[str, str]
    """addresses of the run and of what belongs to it"""


class KindList(TypedDict):
    """All kinds."""

    items: list[KindLine]
    """the entries"""

Language = Literal["en", "ru", "uk"]


class Lengths(TypedDict):
    base: float
    """length of the base, from crank pivot to rocker pivot"""
    crank: float
    """length of the crank"""
    coupler: float
    """length of the coupler"""
    rocker: float
    """length of the rocker"""


class LevelResult(TypedDict):
    """A level of the study."""

    accuracy: float
    """requested and estimated accuracy, and whether it was met; null: nothing was solved"""
    settings: dict[str, float | int | str]
    """numerical settings by name"""
    error: float | None
    """maximum relative error of the main results; null: the level failed"""
    errors: dict[str, float]
    """relative error of each main result, at least the uncertainty of the reference"""
    at_most: bool
    """true: the error is below the uncertainty of the reference, which is shown instead"""
    proven_gap: float | None
    """relative gap between the design and its proven bound; null: no proof"""
    time_min_s: float
    """time min, in s"""
    time_median_s: float
    """time median, in s"""
    runs: int
    """number of timed runs"""


class LinkLengths(TypedDict):
    base: NotRequired[float | None]
    """length of the base, from crank pivot to rocker pivot"""
    crank: NotRequired[float | None]
    """length of the crank"""
    coupler: NotRequired[float | None]
    """length of the coupler"""
    rocker: NotRequired[float | None]
    """length of the rocker"""


class LinkageLimits(TypedDict):
    """Limits of the mechanism; null: none."""

    min_link_mm: NotRequired[float | None]
    """minimum length of any link"""
    joint_radius_mm: NotRequired[float | None]
    """clearance around every joint, added on all sides"""
    longest_link_mm: NotRequired[float | None]
    """longest link, in mm"""
    width_mm: NotRequired[float | None]
    """side of the bounding box of the swept area; needs the effect envelope"""
    height_mm: NotRequired[float | None]
    """side of the bounding box of the swept area; needs the effect envelope"""
    enclosing_radius_mm: NotRequired[float | None]
    """radius of a circle (a pipe) that encloses the swept area"""
    max_pin_force_n: NotRequired[float | None]
    """max pin force, in N"""
    transmission_angle_deg: NotRequired[list[float] | None]
    """range of the transmission angle between coupler and rocker in mid-cycle; null: any"""


class LinkageResult(TypedDict):
    """Results of a linkage; null if a result does not exist (no blow, effect not computed, missing input)."""

    type: str
    """type of change-point linkage, or a URI of the kind of problem"""
    lengths_mm: Lengths | None
    """lengths of the four links, in mm; null: only ratios were given"""
    ratios: Ratios
    """links over crank"""
    closure: ClosureResult
    """closure error of the lengths"""
    rotatable: bool
    """whether the crank can make full turns"""
    confined_deg: float | None
    """a crank that cannot make a full turn stays within ± this angle of the blow"""
    u31_start: float | None
    """magnitude of the transfer function just after the blow"""
    u31_end: float | None
    """magnitude of the transfer function just before the blow"""
    u31_max: float | None
    """maximum magnitude of the transfer function over the cycle"""
    kinematic_restitution: float | None
    """R_k, the restitution without a jump of crank speed; null: the linkage cannot strike"""
    restitution_mismatch: float | None
    """maximum |R - R_k| over the requested range"""
    rocker_swing_deg: float | None
    """rocker swing, in °"""
    transmission_angle_deg: float | None
    """transmission angle between coupler and rocker in mid-cycle"""
    blow_frequency_hz: float | None
    """blow frequency, in Hz"""
    impact_speed_m_s: float | None
    """impact speed, in m/s"""
    longest_link_mm: float | None
    """longest link, in mm"""
    box_mm: SweptBox | None
    """box, in mm"""
    box_area_mm2: float | None
    """box area, in mm²"""
    enclosing_radius_mm: float | None
    """enclosing radius, in mm"""
    peak_torque_nm: float | None
    """maximum torque at the crank, from the rocker's inertia alone"""
    peak_torque_at_deg: float | None
    """peak torque at, in °"""
    pin_force_n: float | None
    """maximum force along the coupler, from the rocker's inertia alone"""
    pin_force_at_deg: float | None
    """pin force at, in °"""
    coupler_peak_n: float | None
    """maximum force after a blow with mismatched restitution, from the coupler's elasticity"""
    window: WindowResult | None
    """effect of the closure error on the blow; null: the lengths close"""
    restitution_error: float | None
    """relative error of the restitution if the lengths are off by their tolerance"""
    tolerance_window: WindowResult | None
    """effect of length tolerances on the blow"""
    running_frequency_hz: float | None
    """blows per second in steady state; needs the drive"""
    running_speed_m_s: float | None
    """running speed, in m/s"""
    irregularity: float | None
    """coefficient of speed fluctuation of the crank, (maximum - minimum)/mean speed"""
    crank_speed_jump: float | None
    """relative jump of the crank's speed at the blow"""
    motor_power_w: float | None
    """motor power, in W"""
    transfer: list[Sample]
    """transfer function u31 over the crank angle"""
    warnings: list[str]
    """warnings about the results"""


class Links(TypedDict):
    """URLs of a run and its resources."""

    self: str
    """the run as JSON"""
    page: str
    """the run's web page"""
    plots: dict[str, str]
    """URLs of the plots, by name"""
    exports: dict[str, str]
    """URLs of the run's exports, by name"""


class Load(TypedDict):
    force_n: float
    """maximum force on the piston"""


class Masses(TypedDict):
    piston_kg: float
    """mass of the piston group: piston, rings, wrist pin"""
    rod_kg: float
    """rod, in kg"""
    rod_cg_from_pin_mm: float
    """distance from the wrist pin to the rod's centre of mass"""
    rod_inertia_kg_m2: NotRequired[float | None]
    """moment of inertia about the centre of mass; null: that of the two-mass model"""
    crank_pin_kg: NotRequired[float]
    """crank pin, in kg"""
    web_kg: NotRequired[float]
    """mass of one of the throw's two webs"""
    web_radius_mm: NotRequired[float]
    """web radius, in mm"""
    counterweight_kg: NotRequired[float]
    """mass of all counterweights of the throw together"""
    counterweight_radius_mm: NotRequired[float]
    """counterweight radius, in mm"""
    rods_per_pin: NotRequired[Literal[1, 2]]
    """rods per crank pin: 2 where the rods of a V engine share one"""

MassesRequest = Union["PendulumRequest", "WeighingRequest", "EstimateRequest"]


class MassesResult(TypedDict):
    """Results, null if the method does not provide them; ``_u``: standard uncertainties, null if unknown."""

    rod_cg_from_pin_mm: float | None
    """rod cg from pin, in mm"""
    rod_cg_from_pin_mm_u: float | None
    """standard uncertainty of the rod cg from pin, in mm"""
    rod_mass_at_pin_kg: float | None
    """rod mass at pin, in kg"""
    rod_mass_at_pin_kg_u: float | None
    """standard uncertainty of the rod mass at pin, in kg"""
    rod_mass_at_crank_kg: float | None
    """rod mass at crank, in kg"""
    rod_mass_at_crank_kg_u: float | None
    """standard uncertainty of the rod mass at crank, in kg"""
    rod_inertia_kg_m2: float | None
    """rod inertia, in kg·m²"""
    rod_inertia_kg_m2_u: float | None
    """standard uncertainty of the rod inertia, in kg·m²"""
    inertia_defect_kg_m2: float | None
    """inertia defect, in kg·m²"""
    inertia_defect_kg_m2_u: float | None
    """standard uncertainty of the inertia defect, in kg·m²"""
    piston_mass_kg: float | None
    """piston mass, in kg"""
    piston_mass_kg_u: float | None
    """standard uncertainty of the piston mass, in kg"""
    rod_mass_kg: float | None
    """rod mass, in kg"""
    rod_mass_kg_u: float | None
    """standard uncertainty of the rod mass, in kg"""
    uncertainty_method: str | None
    """linear propagation of uncertainty, or Monte Carlo where that is not valid"""
    intervals: dict[str, list[float]]
    """central 95 % intervals by Monte Carlo, of the quantities that needed it"""
    warnings: list[str]
    """warnings about the results"""


class MaterialInfo(TypedDict):
    """A material of the catalogue with the sources of its values; null for values its kinds do not use."""

    name: str
    """name in the catalogue"""
    title: str
    """display title"""
    elastic_modulus_gpa: float
    """elastic modulus, in GPa"""
    shear_modulus_gpa: float
    """shear modulus, in GPa"""
    poisson: float
    """Poisson's ratio"""
    density_kg_m3: float
    """density, in kg/m³"""
    allowable_stress_mpa: float | None
    """allowable stress of a pin: a design convention, not a property of the steel"""
    fatigue_limit_mpa: float | None
    """fatigue limit of a smooth specimen in alternating bending"""
    fatigue_reduction: float | None
    """K, fatigue reduction factor: notch, size and surface together"""
    mean_stress_sensitivity: float | None
    """ψ, mean stress sensitivity of Serensen's criterion"""
    yield_strength_mpa: float | None
    """yield strength, in MPa"""
    ultimate_strength_mpa: float | None
    """ultimate strength, in MPa"""
    loss_factor: float | None
    """η, loss factor of a strip in its clamps: twice the damping ratio"""
    sources: dict[str, str]
    """source of every value, by the value's name"""
    kinds: list[str]
    """kinds whose requests accept the name"""


class MaterialList(TypedDict):
    """All materials of the catalogue."""

    items: list[MaterialInfo]
    """the entries"""

Mode = Literal["design", "check", "analysis", "accuracy"]


class ModeInfo(TypedDict):
    """A mode of a kind: path, fields and examples."""

    mode: Mode
    """design, check, analysis or accuracy"""
    path: str
    """path that requests are posted to"""
    fields: list[FieldInfo]
    """every field of the request"""
    example: dict[str, Any]
    """a valid request"""
    examples: dict[str, Any]
    """further examples by title"""
    plots: list[str]
    """plots that runs of this kind may have; each run lists its own"""


class PendulumRequest(TypedDict):
    """The rod swings from its small end, then from its big end."""

    name: NotRequired[str]
    """a name for display; it does not affect the result"""
    effects: NotRequired[Literal["auto", "all"] | EffectChoice]
    """auto, all, or a choice with include and exclude"""
    effect_tolerance: NotRequired[float]
    """maximum relative change of the main results that all omitted effects may cause together"""
    accuracy: NotRequired[float]
    """requested relative numerical accuracy"""
    method: Literal["pendulum"]
    """how the masses are determined"""
    pivot_distance_mm: float
    """distance between the two knife edges"""
    period_small_end_s: float
    """period when hung at the small end"""
    period_big_end_s: float
    """period when hung at the big end"""
    rod_mass_kg: float
    """rod mass, in kg"""
    amplitude_deg: NotRequired[float]
    """amplitude of the swing to either side"""
    gravity_m_s2: NotRequired[float]
    """gravity, in m/s²"""
    small_end_bore_radius_mm: NotRequired[float]
    """bore radius where the knife edge supports the inside of the bore"""
    big_end_bore_radius_mm: NotRequired[float]
    """big end bore radius, in mm"""
    uncertainty: NotRequired[PendulumUncertainty]
    """standard uncertainties of what was measured"""


class PendulumUncertainty(TypedDict):
    """Standard uncertainties of what was measured."""

    pivot_distance_mm: NotRequired[float]
    """pivot distance, in mm"""
    period_small_end_s: NotRequired[float]
    """period small end, in s"""
    period_big_end_s: NotRequired[float]
    """period big end, in s"""
    rod_mass_kg: NotRequired[float]
    """rod mass, in kg"""
    amplitude_deg: NotRequired[float]
    """amplitude, in °"""
    gravity_m_s2: NotRequired[float]
    """gravity, in m/s²"""
    small_end_bore_radius_mm: NotRequired[float]
    """small end bore radius, in mm"""
    big_end_bore_radius_mm: NotRequired[float]
    """big end bore radius, in mm"""


class Piece(TypedDict):
    """A diameter over an interval: the cubic polynomial with these end values and slopes."""

    x_from_mm: float
    """x from, in mm"""
    x_to_mm: float
    """x to, in mm"""
    diameter_from_mm: float
    """diameter from, in mm"""
    diameter_to_mm: float
    """diameter to, in mm"""
    slope_from: float
    """change of the diameter per unit length"""
    slope_to: float
    """slope at the end of the piece"""


class PinCertificate(TypedDict):
    """Certificate of a pin's optimality within its form."""

    method: str
    """argument of the proof"""
    bound: float | None
    """proven bound on the objective of every feasible design, in the objective's unit; null: none is known"""
    gap: float | None
    """relative distance of the answer from the bound; null: no bound is known"""
    evidence: dict[str, float | int | str]
    """figures that support the proof, by name"""
    proven: str
    """what is proven"""
    physics: str
    """the physics to which the proof applies"""
    form: str
    """the designs to which the proof applies"""
    range: str
    """the range of designs covered"""
    estimated: list[str]
    """what is only estimated, and where the estimate is reported"""
    lower_bound_g: float
    """lower bound on the mass of all shapes of this family that satisfy the limits"""


class PinLimits(TypedDict):
    """Constraints in addition to strength; null: none."""

    min_wall_mm: NotRequired[float | None]
    """minimum wall thickness"""
    max_deflection_um: NotRequired[float | None]
    """deflection of the middle relative to the edges of the bosses"""
    max_ovalization_um: NotRequired[float | None]
    """increase of the diameter by ovalization; needs the effect ovalization"""
    max_slope: NotRequired[float | None]
    """change of the bore's diameter per unit length"""
    max_ring_stress_mpa: NotRequired[float | None]
    """hoop stress of the ring; needs the effect ovalization. null: no limit in a design, but the verdict compares it
    with the allowable stress. Textbooks allow 300 to 350 MPa for hardened pins"""


class PinMaterial(TypedDict):
    """The properties of any material."""

    allowable_stress_mpa: float
    """allowable stress, in MPa"""
    allowable_shear_mpa: NotRequired[float | None]
    """allowable shear stress; null: only the strength criterion applies"""
    elastic_modulus_gpa: float
    """elastic modulus, in GPa"""
    poisson: NotRequired[float]
    """Poisson's ratio"""
    density_kg_m3: float
    """density, in kg/m³"""


class PinProfileAccuracyRun(TypedDict):
    """A run: verdict, request, result, effects, accuracy and timing. ``status`` describes only how the solve ended."""

    id: str
    """identifier of the run, part of its address"""
    kind: str
    """discriminator of the form, or the kind of design"""
    mode: Mode
    """design, check, analysis or accuracy"""
    status: RunStatus
    """state or outcome of the solve"""
    name: str
    """name"""
    created_at: str
    """when the run was requested, UTC"""
    spec_hash: str
    """SHA-256 of kind, mode and request, without the name"""
    cached: bool
    """whether the answer was taken from an earlier run of the same request by the same solver"""
    batch_id: str | None
    """the batch that the run belongs to; null: none"""
    holds: bool | None
    """whether every criterion of the verdict holds; null: no verdict"""
    figure: Figure | None
    """null: no result, or a run of an early version"""
    solver: Solver
    """the program that solved"""
    verdict: VerdictResult | None
    """the verdict of an answered design or check; null otherwise, and for runs of early versions"""
    spec: PinProfileStudyRequest
    """the request as understood, with defaults filled in"""
    result: StudyResult | InfeasibleResult | None
    """the result, or the diagnosis; null: not finished, or failed"""
    problem: ProblemDetails | None
    """why there is no answer (RFC 9457); null: there is one"""
    effects: list[EffectResult]
    """every effect with its state and its estimated influence"""
    accuracy: AccuracyResult | None
    """requested and estimated accuracy, and whether it was met; null: nothing was solved"""
    timing: dict[str, float]
    """seconds per step"""
    links: Links
    """addresses of the run and of what belongs to it"""
    progress: RunProgress | None
    """progress of a long run that is not finished"""


class PinProfileCheckRequest(TypedDict):
    """A check: a pin with a given bore, or a bushing with a given outer diameter; constant, or points joined by
    straight lines."""

    name: NotRequired[str]
    """a name for display; it does not affect the result"""
    effects: NotRequired[Literal["auto", "all"] | EffectChoice]
    """auto, all, or a choice with include and exclude"""
    effect_tolerance: NotRequired[float]
    """maximum relative change of the main results that all omitted effects may cause together"""
    accuracy: NotRequired[float]
    """requested relative numerical accuracy"""
    geometry: Geometry
    """diameters and lengths"""
    load: Load | RunForce
    """load on the part"""
    material: PinMaterial | PinSteel
    """strengths, stiffness and density, or a name of the catalogue"""
    criterion: NotRequired[Literal["tresca_paper", "fibre", "saint_venant", "von_mises"]]
    """strength criterion that combines bending and shear in an equivalent stress"""
    limits: NotRequired[PinLimits]
    """further limits"""
    form: NotRequired[BoreForm]
    """family of shapes that a design searches; a drillable outside does not narrow toward the middle"""
    variable: NotRequired[Literal["bore", "outer"]]
    """bore: a pin of given outer diameter; outer: a bushing of given bore_mm"""
    bore_mm: NotRequired[float | None]
    """one bore over the whole length: of the pin to be checked, or of the bushing"""
    profile: NotRequired[list[Point] | None]
    """points with non-decreasing x; two points at the same x are a step; half a pin stands for both halves. Instead
    of bore_mm, or of outer_diameter_mm for a bushing"""


class PinProfileCheckRun(TypedDict):
    """A run: verdict, request, result, effects, accuracy and timing. ``status`` describes only how the solve ended."""

    id: str
    """identifier of the run, part of its address"""
    kind: str
    """discriminator of the form, or the kind of design"""
    mode: Mode
    """design, check, analysis or accuracy"""
    status: RunStatus
    """state or outcome of the solve"""
    name: str
    """name"""
    created_at: str
    """when the run was requested, UTC"""
    spec_hash: str
    """SHA-256 of kind, mode and request, without the name"""
    cached: bool
    """whether the answer was taken from an earlier run of the same request by the same solver"""
    batch_id: str | None
    """the batch that the run belongs to; null: none"""
    holds: bool | None
    """whether every criterion of the verdict holds; null: no verdict"""
    figure: Figure | None
    """null: no result, or a run of an early version"""
    solver: Solver
    """the program that solved"""
    verdict: VerdictResult | None
    """the verdict of an answered design or check; null otherwise, and for runs of early versions"""
    spec: PinProfileCheckRequest
    """the request as understood, with defaults filled in"""
    result: PinResult | Infeasible | None
    """the result, or the diagnosis; null: not finished, or failed"""
    problem: ProblemDetails | None
    """why there is no answer (RFC 9457); null: there is one"""
    effects: list[EffectResult]
    """every effect with its state and its estimated influence"""
    accuracy: AccuracyResult | None
    """requested and estimated accuracy, and whether it was met; null: nothing was solved"""
    timing: dict[str, float]
    """seconds per step"""
    links: Links
    """addresses of the run and of what belongs to it"""
    progress: RunProgress | None
    """progress of a long run that is not finished"""


class PinProfileDesignRequest(TypedDict):
    """A design: the lightest pin or bushing of a form."""

    time_budget_s: NotRequired[float | None]
    """wall-clock limit of this design, at most the limit of the service; null: that limit. A kind that improves its
    design iteratively answers with the best one so far that meets every requirement, with the remaining gap and
    accuracy.met false; any other run that does not finish in time fails"""
    name: NotRequired[str]
    """a name for display; it does not affect the result"""
    effects: NotRequired[Literal["auto", "all"] | EffectChoice]
    """auto, all, or a choice with include and exclude"""
    effect_tolerance: NotRequired[float]
    """maximum relative change of the main results that all omitted effects may cause together"""
    accuracy: NotRequired[float]
    """requested relative numerical accuracy"""
    geometry: Geometry
    """diameters and lengths"""
    load: Load | RunForce
    """load on the part"""
    material: PinMaterial | PinSteel
    """strengths, stiffness and density, or a name of the catalogue"""
    criterion: NotRequired[Literal["tresca_paper", "fibre", "saint_venant", "von_mises"]]
    """strength criterion that combines bending and shear in an equivalent stress"""
    limits: NotRequired[PinLimits]
    """further limits"""
    form: NotRequired[BoreForm]
    """family of shapes that a design searches; a drillable outside does not narrow toward the middle"""
    variable: NotRequired[Literal["bore", "outer"]]
    """bore: a pin of given outer diameter; outer: a bushing of given bore_mm"""
    bore_mm: NotRequired[float | None]
    """one bore over the whole length: of the pin to be checked, or of the bushing"""


class PinProfileDesignResult(TypedDict):
    """The optimal pin, the masses of other forms, and the certificate."""

    mass_g: float
    """mass, in g"""
    solid_mass_g: float | None
    """mass of the same pin without a bore; null for a bushing"""
    constant_bore_mass_g: float | None
    """the best pin of one bore (bushing: of one outer diameter) under the same limits"""
    min_bore_mm: float
    """min bore, in mm"""
    bore_mid_mm: float
    """bore mid, in mm"""
    outer_max_mm: float
    """outer max, in mm"""
    outer_mid_mm: float
    """outer mid, in mm"""
    least_wall_mm: float
    """least wall, in mm"""
    max_moment_nmm: float
    """max moment, in N·mm"""
    max_shear_n: float
    """max shear, in N"""
    equivalent_stress_max_mpa: float | None
    """equivalent stress max, in MPa"""
    worst_section_mm: float
    """worst section, in mm"""
    shear_stress_max_mpa: float | None
    """null without an allowable shear"""
    strength_utilisation: float | None
    """maximum stress over the allowable stress; null: a loaded section has no wall"""
    deflection_um: float | None
    """deflection, in µm"""
    ovalization_um: float | None
    """deflection in the middle of the pin"""
    ovalization_max_um: float | None
    """ovalization where the bore is widest; null: there is no wall"""
    ovalization_stress_max_mpa: float | None
    """maximum hoop stress of the ring, where the wall is thinnest; null: there is no wall"""
    ring_model: str | None
    """model of the ring; null: the effect did not run"""
    ring_stresses_mpa: RingStressesResult | None
    """ring stresses, in MPa"""
    contact_pressures_mpa: PressuresResult | None
    """contact pressures, in MPa"""
    force_limit_n: float | None
    """maximum force that a solid pin carries; null for a bushing"""
    profile: list[Section]
    """diameters along the axis"""
    warnings: list[str]
    """warnings about the results"""
    form: str
    """the optimised shape family"""
    free_mass_g: float
    """the lightest shape of any family under the same limits, except the slope limit"""
    corners: list[Corner] | None
    """points of a piecewise linear shape"""
    contour: list[Piece] | None
    """otherwise: bore diameter, or outer diameter of a bushing, piece by piece"""
    certificate: PinCertificate | None
    """proof that the answer is optimal, or that none exists; null: not proven"""


class PinProfileDesignRun(TypedDict):
    """A run: verdict, request, result, effects, accuracy and timing. ``status`` describes only how the solve ended."""

    id: str
    """identifier of the run, part of its address"""
    kind: str
    """discriminator of the form, or the kind of design"""
    mode: Mode
    """design, check, analysis or accuracy"""
    status: RunStatus
    """state or outcome of the solve"""
    name: str
    """name"""
    created_at: str
    """when the run was requested, UTC"""
    spec_hash: str
    """SHA-256 of kind, mode and request, without the name"""
    cached: bool
    """whether the answer was taken from an earlier run of the same request by the same solver"""
    batch_id: str | None
    """the batch that the run belongs to; null: none"""
    holds: bool | None
    """whether every criterion of the verdict holds; null: no verdict"""
    figure: Figure | None
    """null: no result, or a run of an early version"""
    solver: Solver
    """the program that solved"""
    verdict: VerdictResult | None
    """the verdict of an answered design or check; null otherwise, and for runs of early versions"""
    spec: PinProfileDesignRequest
    """the request as understood, with defaults filled in"""
    result: PinProfileDesignResult | InfeasibleResult | None
    """the result, or the diagnosis; null: not finished, or failed"""
    problem: ProblemDetails | None
    """why there is no answer (RFC 9457); null: there is one"""
    effects: list[EffectResult]
    """every effect with its state and its estimated influence"""
    accuracy: AccuracyResult | None
    """requested and estimated accuracy, and whether it was met; null: nothing was solved"""
    timing: dict[str, float]
    """seconds per step"""
    links: Links
    """addresses of the run and of what belongs to it"""
    progress: RunProgress | None
    """progress of a long run that is not finished"""


class PinProfileStudyRequest(TypedDict):
    """The case, the goal, and the time for measuring."""

    time_budget_s: NotRequired[float | None]
    """time that one solution may take; null: the recommendation goes by the accuracy of the spec"""
    study_budget_s: NotRequired[float]
    """time for the independent reference and the runs, without the tightest solution; a reference that takes longer
    is abandoned, levels for which no time is left are omitted"""
    spec: PinProfileDesignRequest | PinProfileCheckRequest
    """a design request or a check request of this kind"""


class PinResult(TypedDict):
    """Results of a pin; null if a result does not exist (effect not computed, no wall)."""

    mass_g: float
    """mass, in g"""
    solid_mass_g: float | None
    """mass of the same pin without a bore; null for a bushing"""
    constant_bore_mass_g: float | None
    """the best pin of one bore (bushing: of one outer diameter) under the same limits"""
    min_bore_mm: float
    """min bore, in mm"""
    bore_mid_mm: float
    """bore mid, in mm"""
    outer_max_mm: float
    """outer max, in mm"""
    outer_mid_mm: float
    """outer mid, in mm"""
    least_wall_mm: float
    """least wall, in mm"""
    max_moment_nmm: float
    """max moment, in N·mm"""
    max_shear_n: float
    """max shear, in N"""
    equivalent_stress_max_mpa: float | None
    """equivalent stress max, in MPa"""
    worst_section_mm: float
    """worst section, in mm"""
    shear_stress_max_mpa: float | None
    """null without an allowable shear"""
    strength_utilisation: float | None
    """maximum stress over the allowable stress; null: a loaded section has no wall"""
    deflection_um: float | None
    """deflection, in µm"""
    ovalization_um: float | None
    """deflection in the middle of the pin"""
    ovalization_max_um: float | None
    """ovalization where the bore is widest; null: there is no wall"""
    ovalization_stress_max_mpa: float | None
    """maximum hoop stress of the ring, where the wall is thinnest; null: there is no wall"""
    ring_model: str | None
    """model of the ring; null: the effect did not run"""
    ring_stresses_mpa: RingStressesResult | None
    """ring stresses, in MPa"""
    contact_pressures_mpa: PressuresResult | None
    """contact pressures, in MPa"""
    force_limit_n: float | None
    """maximum force that a solid pin carries; null for a bushing"""
    profile: list[Section]
    """diameters along the axis"""
    warnings: list[str]
    """warnings about the results"""


class PinSteel(TypedDict):
    """A steel of the catalogue, with an optional allowable stress that overrides the catalogue's."""

    name: Literal["pin-steel-17Cr3", "pin-steel-16MnCr5", "pin-steel-31CrMoV9"]
    """name of a material in the catalogue"""
    allowable_stress_mpa: NotRequired[float | None]
    """allowable stress; null: that of the catalogue"""
    allowable_shear_mpa: NotRequired[float | None]
    """allowable shear stress; null: only the strength criterion applies"""


class Piston(TypedDict):
    diameter_mm: float
    """diameter, in mm"""
    skirt_length_mm: float
    """skirt length, in mm"""
    reciprocating_mass_kg: NotRequired[float]
    """mass of the piston and of the rod's upper share"""
    clamp_offset_mm: NotRequired[float]
    """e, distance of the clamp from mid-skirt toward the crank"""
    friction_coefficient: NotRequired[float]
    """friction coefficient between piston and cylinder"""


class Point(TypedDict):
    """A position and the diameter there: a pin's bore or a bushing's outer diameter."""

    x_mm: float
    """x, in mm"""
    bore_mm: NotRequired[float | None]
    """bore, in mm"""
    outer_diameter_mm: NotRequired[float | None]
    """outer diameter, in mm"""


class PressuresResult(TypedDict):
    small_end: float
    """mean in the rod's small end"""
    boss_mean: float
    """mean over a boss"""
    boss_peak: float
    """maximum, at the boss's inner edge"""


class ProblemDetails(TypedDict):
    """An error response (RFC 9457)."""

    type: str
    """URI of the kind of problem, documented under /docs; about:blank: the status describes it"""
    title: str
    """the kind of problem in words"""
    status: int
    """HTTP status"""
    detail: str
    """what is wrong"""
    errors: NotRequired[list[ProblemEntry]]
    """one entry per invalid field"""


class ProblemEntry(TypedDict):
    """An invalid field."""

    pointer: str
    """JSON pointer of the field (RFC 6901)"""
    detail: str
    """what is wrong"""
    allowed: str
    """the accepted values"""


class RatioGiven(TypedDict):
    """The free ratio of the type: lambda2 (coupler/crank), or lambda0 (base/crank) for largest_base."""

    lambda0: NotRequired[float | None]
    """base over crank"""
    lambda2: NotRequired[float | None]
    """coupler over crank"""


class Ratios(TypedDict):
    """Link lengths relative to the crank."""

    lambda0: float
    """base over crank"""
    lambda2: float
    """coupler over crank"""
    lambda3: float
    """rocker over crank"""


class RepairDone(TypedDict):
    """A repair of the user's points, and where the first fault was."""

    pointer: str
    """JSON pointer of the field (RFC 6901)"""
    what: str
    """what was changed"""


class Requirements(TypedDict):
    """Minimum safeties and maximum loads on the piston's guide."""

    min_fatigue_safety: NotRequired[float]
    """safety factor against fatigue"""
    min_stability_safety: NotRequired[float]
    """safety factor against buckling"""
    max_contact_pressure_mpa: NotRequired[float | None]
    """needs the effect friction"""
    max_friction_power_w: NotRequired[float | None]
    """needs the effect friction"""
    min_yield_safety: NotRequired[float | None]
    """safety factor against yield; null: no requirement, the verdict judges it by 1"""


class RestitutionRange(TypedDict):
    """A range of restitution coefficients; the mechanism is designed for the middle."""

    low: float
    """lower end of the range"""
    high: float
    """upper end of the range"""


class RingStressesResult(TypedDict):
    """Hoop stresses in the middle of the pin: at the side and under the load, at the outer and inner fibre."""

    outer_side: float
    """hoop stress at the outer surface, in the mean plane"""
    inner_side: float
    """hoop stress at the inner surface, in the mean plane"""
    outer_top: float
    """hoop stress at the outer surface, under the load"""
    inner_top: float
    """hoop stress at the inner surface, under the load"""


class RodBounds(TypedDict):
    b_mm: list[float]
    """minimum and maximum"""
    h_mm: list[float]
    """minimum and maximum"""
    l_mm: list[float]
    """minimum and maximum"""


class RodResult(TypedDict):
    """Results of a strip; null if a result does not exist (no load, effect not computed, unstable)."""

    dimensions: Dimensions
    """width, thickness and free length of the strip"""
    fatigue_safety: float | None
    """safety factor against fatigue; null: no alternating stress, or no stresses exist"""
    stability_safety: float | None
    """critical force over the maximum compression; null: no compression"""
    yield_safety: float | None
    """yield strength over the maximum stress; null: no stresses exist"""
    critical_force_n: float
    """critical force, in N"""
    buckles_sideways: bool
    """whether the strip is less stiff across the crank's plane than in it and buckles out of plane"""
    axial_force_min_n: float
    """axial force min, in N"""
    axial_force_max_n: float
    """axial force max, in N"""
    stress_amplitude_mpa: float | None
    """stress amplitude, in MPa"""
    stress_mean_mpa: float | None
    """stress mean, in MPa"""
    worst_section_mm: float | None
    """worst section, in mm"""
    worst_fibre: int | None
    """governing side of the strip: 1 at +h/2, -1 at -h/2"""
    side_force_max_n: float | None
    """side force max, in N"""
    clamp_moment_max_nmm: float | None
    """clamp moment max, in N·mm"""
    contact_pressure_max_mpa: float | None
    """contact pressure max, in MPa"""
    friction_power_w: float | None
    """friction power, in W"""
    deflection_ratio: float | None
    """maximum deflection over the free length; null: no equilibrium shape exists"""
    natural_frequency_hz: float
    """natural frequency, in Hz"""
    mass_g: float
    """mass, in g"""
    fatigue_criterion: str
    """fatigue criterion"""
    repairs: list[RepairDone]
    """repairs of the load's points; empty unless requested"""
    warnings: list[str]
    """warnings about the results"""


class Run(TypedDict):
    """A run: verdict, request, result, effects, accuracy and timing. ``status`` describes only how the solve ended."""

    id: str
    """identifier of the run, part of its address"""
    kind: str
    """discriminator of the form, or the kind of design"""
    mode: Mode
    """design, check, analysis or accuracy"""
    status: RunStatus
    """state or outcome of the solve"""
    name: str
    """name"""
    created_at: str
    """when the run was requested, UTC"""
    spec_hash: str
    """SHA-256 of kind, mode and request, without the name"""
    cached: bool
    """whether the answer was taken from an earlier run of the same request by the same solver"""
    batch_id: str | None
    """the batch that the run belongs to; null: none"""
    holds: bool | None
    """whether every criterion of the verdict holds; null: no verdict"""
    figure: Figure | None
    """null: no result, or a run of an early version"""
    solver: Solver
    """the program that solved"""
    verdict: VerdictResult | None
    """the verdict of an answered design or check; null otherwise, and for runs of early versions"""
    spec: dict[str, Any]
    """the request as understood, with defaults filled in"""
    result: dict[str, Any] | None
    """the result, or the diagnosis; null: not finished, or failed"""
    problem: ProblemDetails | None
    """why there is no answer (RFC 9457); null: there is one"""
    effects: list[EffectResult]
    """every effect with its state and its estimated influence"""
    accuracy: AccuracyResult | None
    """requested and estimated accuracy, and whether it was met; null: nothing was solved"""
    timing: dict[str, float]
    """seconds per step"""
    links: Links
    """addresses of the run and of what belongs to it"""
    progress: RunProgress | None
    """progress of a long run that is not finished"""


class RunForce(TypedDict):
    """The force at a worst instant of a stored crank-dynamics run; filled in by the service."""

    kind: Literal["run"]
    """discriminator of the form, or the kind of design"""
    run_id: str
    """the id of a stored run"""
    instant: NotRequired[Literal["gas_force_max", "rod_compression_max", "rod_tension_max", "side_force_max", "wrist_pin_load_max", "crank_pin_load_max", "main_bearing_load_max"]]
    """which of the maximum forces is used"""
    force_n: NotRequired[float | None]
    """filled in from the run"""
    taken_from: NotRequired[str | None]
    """filled in: kind and hash of the run's own request"""


class RunLine(TypedDict):
    """A run in a listing."""

    id: str
    """identifier of the run, part of its address"""
    kind: str
    """discriminator of the form, or the kind of design"""
    mode: Mode
    """design, check, analysis or accuracy"""
    status: RunStatus
    """state or outcome of the solve"""
    name: str
    """name"""
    created_at: str
    """when the run was requested, UTC"""
    spec_hash: str
    """SHA-256 of kind, mode and request, without the name"""
    cached: bool
    """whether the answer was taken from an earlier run of the same request by the same solver"""
    batch_id: str | None
    """the batch that the run belongs to; null: none"""
    holds: bool | None
    """whether every criterion of the verdict holds; null: no verdict"""
    figure: Figure | None
    """null: no result, or a run of an early version"""
    solver: Solver
    """the program that solved"""


class RunLoad(TypedDict):
    """A stored crank-dynamics run: its pressures (two strokes), or the pressure of a worst instant at all angles.
    The service fills in the data."""

    kind: Literal["run"]
    """discriminator of the form, or the kind of design"""
    run_id: str
    """the id of a stored run"""
    instant: NotRequired[Literal["gas_force_max", "rod_compression_max", "rod_tension_max", "side_force_max", "wrist_pin_load_max", "crank_pin_load_max", "main_bearing_load_max"] | None]
    """the instant whose pressure acts at all angles; null: all pressures of the cycle"""
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
    """A page of runs; ``next_cursor`` requests the next one."""

    items: list[RunLine]
    """the entries"""
    next_cursor: str | None
    """cursor of the next page; null: this is the last page"""
    damaged: list[str]
    """ids of runs of this page with damaged records"""


class RunProgress(TypedDict):
    """Progress of a run."""

    done: int
    """solutions found"""
    of: int
    """upper limit; a time budget may end the run earlier"""
    doing: str
    """the current step"""

RunStatus = Literal["queued", "running", "succeeded", "infeasible", "failed", "cancelled"]


class Sample(TypedDict):
    phi_deg: float
    """phi, in °"""
    u31: float
    """speed of the rocker over that of the crank"""


class SchmidtLoad(TypedDict):
    """p = p_min (1 + δ)/(1 − δ cos(φ − θ)): the isothermal Stirling cycle."""

    kind: Literal["schmidt"]
    """discriminator of the form, or the kind of design"""
    p_min_mpa: float
    """p min, in MPa"""
    delta: float
    """compression parameter"""
    theta_rad: float
    """crank angle of maximum pressure"""
    back_pressure_mpa: NotRequired[float | None]
    """null: the mean of the cycle"""


class Section(TypedDict):
    """A cross-section of the pin."""

    x_mm: float
    """x, in mm"""
    bore_mm: float
    """bore, in mm"""
    outer_diameter_mm: float
    """outer diameter, in mm"""
    moment_nmm: float
    """moment, in N·mm"""
    shear_n: float
    """shear, in N"""
    equivalent_stress_mpa: float | None
    """null: a loaded section has no wall"""


class Series(TypedDict):
    """Results over the angle, one list per quantity, each rounded to a hundredth of the accuracy asked, relative to
    its greatest value. Rod compression is positive; the radial force points to the shaft."""

    angle_deg: list[float]
    """angle, in °"""
    pressure_mpa: list[float]
    """pressure, in MPa"""
    brix_pressure_mpa: list[float] | None
    """the diagram's pressures unrolled by Brix's construction; null: pressures given over the angle"""
    gas_force_n: list[float]
    """gas force, in N"""
    inertia_force_n: list[float]
    """inertia force, in N"""
    side_force_n: list[float]
    """side force, in N"""
    rod_force_n: list[float]
    """rod force, in N"""
    tangential_force_n: list[float]
    """tangential force, in N"""
    radial_force_n: list[float]
    """radial force, in N"""
    torque_nm: list[float]
    """torque, in N·m"""
    wrist_pin_load_n: list[float]
    """wrist pin load, in N"""
    crank_pin_load_n: list[float]
    """crank pin load, in N"""
    main_bearing_load_n: list[float]
    """main bearing load, in N"""


class ShortfallResult(TypedDict):
    """An unattainable requirement."""

    requirement: str
    """name of the field or limit"""
    required: float
    """the required value"""
    attainable: float | None
    """best value beside those of the other requirements that can be met, accurate to accuracy.estimated; null:
    unknown"""
    advice: str
    """what would have to change to meet the requirement"""


class Solver(TypedDict):
    """The solver that produced a result."""

    name: str
    """name of the program"""
    version: str
    """version of the solver"""


class Steps(TypedDict):
    """Increments to which width and free length are rounded; null: not rounded."""

    b: NotRequired[float | None]
    """width of the strip"""
    l: NotRequired[float | None]
    """free length of the strip"""


class Stroke(TypedDict):
    """The points of one stroke; volumes with the clearance volume, in either order."""

    volume_cm3: list[float]
    """volume, in cm³"""
    pressure_mpa: list[float]
    """one per volume"""


class StudyResult(TypedDict):
    """Error against time, from loose to tight, and the influence of each effect."""

    levels: list[LevelResult]
    """settings from loose to tight, with their errors and times"""
    reference: str
    """method of the reference"""
    reference_accuracy: float
    """relative uncertainty of the reference, of its least certain result"""
    recommended: LevelResult | None
    """the cheapest level that meets the spec's accuracy, or the best within the time"""
    certified: LevelResult | None
    """the cheapest level whose design is proven optimal within the accuracy of the spec, or else the one with the
    smallest gap; null: nothing is proven"""
    effect_costs: list[EffectCostResult]
    """influence and cost of each effect in this case"""


class Sweep(TypedDict):
    """A request of which some fields are varied."""

    kind: str
    """kind of design"""
    mode: Literal["design", "check", "analysis", "accuracy"]
    """design, check, analysis or accuracy"""
    name: NotRequired[str]
    """name"""
    detail: NotRequired[Literal["scalars", "full"]]
    """what is wrong"""
    base: dict[str, Any]
    """what every request has"""
    vary: dict[str, Vary]
    """dotted field: its values"""
    combine: NotRequired[Literal["grid", "zip", "latin_hypercube", "sobol"]]
    """how the values are combined: grid, zip, latin_hypercube or sobol"""
    samples: NotRequired[int | None]
    """number of points of latin_hypercube and sobol"""
    seed: NotRequired[int]
    """seed of the samples: the same seed gives the same samples"""


class SweptBox(TypedDict):
    """The smallest box around the swept area of links and joints; ``angle_deg`` from the base line to its width."""

    width: float
    """width of the bounding box"""
    height: float
    """height of the bounding box"""
    angle_deg: float
    """angle, in °"""

System = Literal["metric", "inch"]


class TableLoad(TypedDict):
    """Pressures at crank angles, joined by a monotone periodic cubic. A last point may close the turn with the
    pressure of the first."""

    kind: Literal["table"]
    """discriminator of the form, or the kind of design"""
    angle_deg: list[float]
    """ascending, within one revolution"""
    pressure_mpa: list[float]
    """one per angle"""
    back_pressure_mpa: NotRequired[float | None]
    """null: the mean of the cycle"""


class TablePressure(TypedDict):
    """Pressures at crank angles of one cycle, joined by a monotone periodic cubic."""

    kind: Literal["table"]
    """discriminator of the form, or the kind of design"""
    angle_deg: list[float]
    """ascending, within one cycle"""
    pressure_mpa: list[float]
    """one per angle"""
    repair: NotRequired[bool]
    """repair faulty points and report each repair"""

Tool = Literal["freecad", "fusion", "onshape", "solidworks", "inventor"]


class Unbalance(TypedDict):
    order: int
    """order of the harmonic, in multiples of the crank's frequency"""
    force_n: float
    """force, in N"""
    couple_nm: float | None
    """couple, in N·m"""

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
    """The verdict: the part holds only if every criterion does."""

    holds: bool
    """whether the part holds: true only if every criterion does"""
    certain: NotRequired[bool]
    """false: the estimated error exceeds the distance of a figure from its limit"""
    error: NotRequired[float]
    """estimated relative error of the figures if the verdict depends on it, else 0"""
    summary: str
    """one sentence with the governing figure"""
    governed_by: str | None
    """the criterion with the smallest margin; if certain is false, the one that makes it uncertain; null: no load
    acts"""
    criteria: list[CriterionResult]
    """every requirement, limit and strength criterion"""
    cautions: list[str]
    """remarks beyond the criteria"""


class WeighingRequest(TypedDict):
    """The rod lies level on two supports at its pin centres; a period adds the moment of inertia."""

    name: NotRequired[str]
    """a name for display; it does not affect the result"""
    effects: NotRequired[Literal["auto", "all"] | EffectChoice]
    """auto, all, or a choice with include and exclude"""
    effect_tolerance: NotRequired[float]
    """maximum relative change of the main results that all omitted effects may cause together"""
    accuracy: NotRequired[float]
    """requested relative numerical accuracy"""
    method: Literal["weighing"]
    """how the masses are determined"""
    length_mm: float
    """distance between the pin centres"""
    small_end_reading_kg: float
    """small end reading, in kg"""
    big_end_reading_kg: float
    """big end reading, in kg"""
    rod_mass_kg: NotRequired[float | None]
    """total mass, weighed separately to check the sum of the two readings"""
    period_small_end_s: NotRequired[float | None]
    """period when hung at the small end; null: no moment of inertia is computed"""
    small_end_bore_radius_mm: NotRequired[float]
    """small end bore radius, in mm"""
    amplitude_deg: NotRequired[float]
    """amplitude of the swing to either side"""
    gravity_m_s2: NotRequired[float]
    """gravity, in m/s²"""
    uncertainty: NotRequired[WeighingUncertainty]
    """standard uncertainties of what was measured"""


class WeighingUncertainty(TypedDict):
    """Standard uncertainties of what was measured."""

    length_mm: NotRequired[float]
    """length, in mm"""
    small_end_reading_kg: NotRequired[float]
    """small end reading, in kg"""
    big_end_reading_kg: NotRequired[float]
    """big end reading, in kg"""
    period_small_end_s: NotRequired[float]
    """period small end, in s"""
    amplitude_deg: NotRequired[float]
    """amplitude, in °"""
    gravity_m_s2: NotRequired[float]
    """gravity, in m/s²"""
    small_end_bore_radius_mm: NotRequired[float]
    """small end bore radius, in mm"""


class WindowResult(TypedDict):
    """Effect of a closure error on the blow."""

    angle_deg: float
    """half-width of the range of crank angles concerned"""
    blocked: bool
    """true: the crank cannot enter; false: the rocker turns back early"""
    short_stop_deg: float
    """short stop, in °"""


class WorstInstant(TypedDict):
    """The instant of a force's maximum."""

    name: str
    """name"""
    angle_deg: float
    """angle, in °"""
    force_n: float
    """force, in N"""
    pressure_mpa: float
    """pressure, in MPa"""
    feeds: str | None
    """the kind of design for which this instant is the load"""
