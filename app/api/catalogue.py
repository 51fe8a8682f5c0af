"""GET /api/v1/kinds and /api/v1/materials: the catalogue, from which a client can build its forms."""

from __future__ import annotations

from functools import cache
from typing import Any

from fastapi import APIRouter, Request, Response
from pydantic import Field

from app.api.contract import PATHS, Shown
from app.designs.fields import FieldInfo, fields_of, objectives_of
from app.designs.kind import Kind, Mode
from app.designs.registry import KINDS, example_of, modes_of, plots_of
from app.designs.schema import MAX_TIME_S, scaled
from app.designs.units import in_si
from app.errors import Problem
from app.exports.export import Tool, has_part
from app.exports.registry import EXPORTS
from solvers import materials as strips
from solvers import pin

router = APIRouter(prefix="/api/v1", tags=["catalogue"])


class EffectInfo(Shown):
    """An effect of the kind."""

    name: str
    summary: str
    measure: str


class ExportInfo(Shown):
    """An export format of the kind's runs."""

    name: str
    title: str
    media_type: str
    extension: str
    tools: list[str] = Field(description="values that ?for= accepts, for the parameters export; empty for all others")
    available: bool = Field(description="false: a required extra is not installed")


class ModeInfo(Shown):
    """A mode of a kind: path, fields and examples."""

    mode: Mode
    path: str = Field(description="path that requests are posted to")
    fields: list[FieldInfo]
    example: dict[str, Any]
    examples: dict[str, Any] = Field(description="further examples by title")
    plots: list[str] = Field(description="plots that runs of this kind may have; each run lists its own")


class KindLine(Shown):
    """A kind in the listing."""

    kind: str
    title: str
    summary: str
    modes: list[Mode]
    links: dict[str, str]


class KindList(Shown):
    """All kinds."""

    items: list[KindLine]


class KindInfo(KindLine):
    """Everything about a kind."""

    objectives: list[str] = Field(description="objectives of a design; empty if there is only one")
    effects: list[EffectInfo]
    exports: list[ExportInfo]
    requests: list[ModeInfo]


class MaterialInfo(Shown):
    """A material of the catalogue with the sources of its values; null for values its kinds do not use."""

    name: str
    title: str
    elastic_modulus_gpa: float
    shear_modulus_gpa: float
    poisson: float
    density_kg_m3: float
    allowable_stress_mpa: float | None = Field(
        description="allowable stress of a pin: a design convention, not a property of the steel"
    )
    fatigue_limit_mpa: float | None = Field(description="fatigue limit of a smooth specimen in alternating bending")
    fatigue_reduction: float | None = Field(description="K, fatigue reduction factor: notch, size and surface together")
    mean_stress_sensitivity: float | None = Field(description="ψ, mean stress sensitivity of Serensen's criterion")
    yield_strength_mpa: float | None
    ultimate_strength_mpa: float | None
    loss_factor: float | None = Field(description="η, loss factor of a strip in its clamps: twice the damping ratio")
    sources: dict[str, str] = Field(description="source of every value, by the value's name")
    kinds: list[str] = Field(description="kinds whose requests accept the name")


class MaterialList(Shown):
    """All materials of the catalogue."""

    items: list[MaterialInfo]


@router.get("/kinds", summary="List kinds", response_model=KindList)
async def list_kinds() -> Response:
    """Every kind with its modes."""
    return _json(_all_kinds())


@router.get(
    "/kinds/{kind}",
    summary="One kind: fields, effects, objectives, plots, exports, examples",
    response_model=KindInfo,
    responses={404: {"description": "there is no such kind"}},
)
async def one_kind(kind: str, request: Request) -> Response:
    """Everything needed to build a form."""
    if kind not in KINDS:
        raise Problem(404, "No such kind", "there are " + ", ".join(KINDS))
    return _json(_one_kind(kind, request.app.state.settings.solve_budget_s))


@router.get("/materials", summary="List materials", response_model=MaterialList)
async def list_materials() -> Response:
    """The catalogue. Typical values for orientation, not for release."""
    return _json(_all_materials())


def _json(content: bytes) -> Response:
    return Response(content, media_type="application/json", headers={"Cache-Control": "public, max-age=300"})


@cache
def _all_kinds() -> bytes:
    return KindList(items=[KindLine(**_line(kind)) for kind in KINDS.values()]).model_dump_json().encode()


def _line(kind: Kind) -> dict[str, Any]:
    modes = list(modes_of(kind))
    links = {"self": f"/api/v1/kinds/{kind.slug}", "page": f"/designs/{kind.slug}?mode={modes[0]}"}
    return {"kind": kind.slug, "title": kind.title, "summary": kind.summary, "modes": modes, "links": links}


@cache
def _one_kind(slug: str, longest_s: float) -> bytes:
    kind = KINDS[slug]
    return KindInfo(
        **_line(kind),
        objectives=objectives_of(kind),
        effects=[EffectInfo(**effect) for effect in kind.effects()],
        exports=[
            ExportInfo(
                name=e.name, title=e.title, media_type=e.media_type, extension=e.extension,
                tools=[str(tool) for tool in Tool] if e.name == "parameters" else [], available=not e.missing,
            )
            for e in EXPORTS.values()
            if kind.part is not None or e.applies is not has_part
        ],
        requests=[
            ModeInfo(
                mode=mode,
                path=f"/api/v1/{PATHS[mode]}/{slug}",
                fields=[_limited(field, longest_s) for field in fields_of(kind, mode)],
                example=dict(example_of(kind, mode)),
                examples={} if mode is Mode.ACCURACY else kind.others(mode),
                plots=list(plots_of(kind, mode)),
            )
            for mode in modes_of(kind)
        ],
    ).model_dump_json().encode()  # fmt: skip


def _limited(field: FieldInfo, longest_s: float) -> FieldInfo:
    """The field as this service accepts it: a design has at most the service's time."""
    if field.path in ("time_budget_s", "spec.time_budget_s") and field.maximum == MAX_TIME_S:
        return field.model_copy(update={"maximum": longest_s})
    return field


@cache
def _all_materials() -> bytes:
    found = [_material(name, entry) for name, entry in {**strips.CATALOGUE, **pin.CATALOGUE}.items()]
    return MaterialList(items=found).model_dump_json().encode()


def _material(name: str, entry: Any) -> MaterialInfo:
    """An entry of the strip or the pin catalogue."""
    fields = {in_si(field)[0]: field for field in MaterialInfo.model_fields}
    numbers = {
        field: scaled(getattr(entry, quantity, None), in_si(field)[1])
        for quantity, field in fields.items()
        if field not in ("name", "title", "sources", "kinds")
    }
    takers = [
        kind.slug
        for kind in KINDS.values()
        if any(name in (field.choices or ()) for mode in kind.jobs for field in fields_of(kind, mode))
    ]
    sources = {fields[quantity]: source for quantity, source in entry.sources.items()}
    return MaterialInfo(name=name, title=entry.title, **numbers, sources=sources, kinds=takers)
