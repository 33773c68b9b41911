"""What a step reported, as values. Names and units are those of the contract.

Values of enums are words (`converged`), a vector is a tuple of x, y and z, and what is absent is None.
"""

from __future__ import annotations

from dataclasses import dataclass

Vector = tuple[float, float, float]
"""Three components along right-handed axes, y up."""
Quaternion = tuple[float, float, float, float]
"""A turn: x, y, z, w, of length 1. The last is the cosine of half the angle about the axis of the first three."""


@dataclass(frozen=True)
class SolveReport:
    """How a linear solve ended."""

    outcome: str
    """How it ended, such as `converged` or `iteration_cap`."""
    iterations: int
    """Iterations that were made."""
    relative_residual: float
    """Norm of the residual divided by that of the right-hand side: of cloth sqrt(r.z), z = M^-1 r with the
    preconditioner M; of snow the same with the nodes' masses for M."""


@dataclass(frozen=True)
class ClothSteps:
    """How one step of the scene was divided into sub-steps, which all cloths share."""

    substeps: int
    """Sub-steps that were taken."""
    rejected: int
    """Sub-steps that were not accepted, and taken again shorter."""
    dt_seconds: float
    """Length of the last sub-step (s)."""
    bound: str
    """What bounds the next sub-step."""
    bound_particle: int | None
    """The particle that sets the bound. None if none does."""
    bound_seconds: float
    """Longest sub-step that the bound allows (s)."""
    error_rms: float
    """Estimated error that a sub-step makes in positions (m), the largest of all sub-steps and bodies: root of the
    mean square over the free particles of a body."""
    error_largest: float
    """The same of the particle with the largest error."""
    preconditioner: str | None
    """Preconditioner of the linear solves, as scenes name it: what "auto" chose, where the scene leaves the choice.
    None where no linear system is solved."""
    solve_error_m: float
    """What both errors count of linear solves that ended at their cap, above their tolerance: about how far the
    particle is off (m) that is furthest off. 0 where none did."""
    solves: int
    """Linear solves of the sub-steps that were taken, of the body that made most of them: as many as sub-steps where
    one was enough for each. 0 where no linear system is solved."""


@dataclass(frozen=True)
class SnowDiagnostics:
    """What the snow reported after one step of the scene."""

    substeps: int
    """Steps of the snow within this step of the scene."""
    dt_seconds: float
    """Length of the last step of the snow (s)."""
    bound: str
    """What bounds the next step of the snow."""
    bound_particle: int | None
    """The particle that sets the bound, over all particles. None if none does."""
    bound_seconds: float
    """Longest step that the bound allows (s). The largest finite number if nothing bounds the step."""
    mass: float
    """Mass of all particles (kg)."""
    grid_mass_error: float
    """Mass on the grid divided by mass of the particles, minus 1."""
    plastic_count: int
    """Particles that yielded in the last step."""
    inverted_count: int
    """Particles that were inverted."""
    clamped_count: int
    """Particles whose plastic volume ratio was clamped to its range."""
    ballistic_count: int
    """Particles that are nearly alone on the grid and move without stress."""
    min_plastic_ratio: float
    """Smallest plastic volume ratio J_P."""
    max_plastic_ratio: float
    """Largest plastic volume ratio J_P."""
    max_speed: float
    """Speed of the fastest particle (m/s)."""
    dropped_momentum: float
    """Momentum of nodes that are too light to carry a velocity (kg m/s)."""
    angular_momentum: Vector
    """Angular momentum about the origin (kg m^2/s)."""
    block_count: int
    """Blocks of 4 x 4 x 4 nodes in use."""
    torn_count: int
    """Particles that are stretched farther than the cells of the grid can bear, also of objects that may break."""


@dataclass(frozen=True)
class Notices:
    """How often something happened that does not fail a step, but makes its result doubtful."""

    capped_solves: int
    """Solves of cloth that ended at their largest number of iterations above their tolerance. A scene that fixes the
    number of iterations has none."""
    indefinite_solves: int
    """Solves of cloth that met a curvature or a preconditioner that is not positive."""
    passed_particles: int
    """Particles, pins of cloth too, that went through a collider or into it within a step, each once per sub-step in
    which it did."""
    rejected_steps: int
    """Sub-steps of cloth that were not accepted, and taken again shorter."""
    pinched_particles: int
    """Particles of cloth that touch a mesh collider and are still nearer to it than its margin after contact, by more
    than 1e-9 m, each once per sub-step in which it was: surfaces that meet there leave no place for the margin."""
    yielding_corners: int
    """Corners of figures that cloth holds more than 1 mm off their frames, each once per sub-step at the end of which
    it was."""
    torn_particles: int
    """Particles of objects of snow without plasticity that are stretched farther than the cells of the grid can bear,
    each once per step of the scene at whose end it is: no law of theirs lets them break, and they tear."""
    first_torn_particle: int | None
    """The first of them, over all particles. None if there is none."""
    first_torn_seconds: float | None
    """When it was first torn: simulated time at the end of that step (s). None if there is none."""


@dataclass(frozen=True)
class SurfaceReport:
    """What kept surfaces of cloth apart in one step of the scene."""

    pairs: int
    """Pairs of a vertex and a triangle, or of two edges, that could meet within the last sub-step."""
    active: int
    """Those of them that pushed in the last solve of the last sub-step."""
    rounds: int
    """The most solves that a sub-step made, between which pairs were added and dropped."""
    least_gap_m: float | None
    """The least distance of a pair at the end of any sub-step (m). None where none had a pair."""
    failed: int
    """Sub-steps that were not accepted since pairs could not be kept apart."""
    crossings: int | None
    """Pairs of an edge and a triangle that cross, counted exactly at the end of each sub-step: the most of any. None
    where the scene does not ask for the count."""
    yield_m: float
    """How far the corner of a figure that is farthest from its frame is off it, at the end of the step (m). 0 without
    figures."""
    yielding: int
    """Corners of figures that are more than 1 mm off their frames, at the end of the step."""
    largest_push_n: float
    """The largest force with which a pair pushed in the last solve of a sub-step, over all sub-steps (N). 0 where none
    pushed."""


@dataclass(frozen=True)
class RestReport:
    """How still cloth lies, watched over windows of eight steps of the scene, and what of it sleeps. A piece is what
    springs and elements hold together; a particle without them is one by itself."""

    calm_share: float
    """Share of the particles that are in calm pieces, from 0 to 1."""
    pieces: int
    """Pieces of cloth."""
    calm_pieces: int
    """Those of them that are calm."""
    way_m: float
    """The farthest that a particle was from where it began the last whole window (m). 0 before the first window has
    ended."""
    change_m: float
    """Half of the largest change of a particle's way within the last whole window from that within the one before (m).
    0 before the first window has ended."""
    awake_share: float
    """Share of the particles that are awake, from 0 to 1. What sleeps is stepped seldom."""
    pieces_asleep: int
    """Pieces that sleep."""
    told_m: float
    """An estimate of how far off positions are since cloth slept (m), of the body that is off most."""
    long_steps: int
    """Long steps that bodies have taken since their beginning."""
    wakes: int
    """How often bodies were woken since their beginning."""
    wake_cause: str | None
    """Why the one that woke last did. None where none has."""


@dataclass(frozen=True)
class ColliderLoad:
    """What a collider felt in a step: minus the impulses that contact gave to cloth and snow, over the length of the
    step."""

    name: str
    """The collider's name in the scene."""
    force: Vector
    """Mean force (N)."""
    torque: Vector
    """Mean torque about the collider's reference point, where that is at the end of the step (N m)."""
    contacts: int
    """Particles of cloth that touched it, each once per sub-step, and nodes of the snow's grid within it, each once per
    step of the snow."""


@dataclass(frozen=True)
class Diagnostics:
    """What one step reported."""

    step: int
    """Steps taken, this one included."""
    time_seconds: float
    """Simulated time (s)."""
    frame: int
    """Number of the newest frame after the step."""
    kinetic_energy: float
    """Kinetic energy (J)."""
    elastic_energy: float
    """Elastic energy of springs and snow (J)."""
    gravitational_energy: float
    """Gravitational energy (J). 0 at the origin."""
    momentum: Vector
    """Linear momentum of the free particles (kg m/s)."""
    max_stretch: float
    """Largest ratio of length to rest length among the springs. 0 without springs."""
    contact_count: int
    """Particles of cloth in contact with a collider, each once per sub-step, and nodes of the snow's grid."""
    solve: SolveReport | None
    """The linear solve of cloth with the largest residual, with the iterations that its body made in the step; the
    last solve of snow. None with explicit integrators."""
    stages: dict[str, float]
    """Wall-clock time of each stage of the step (s), by its name."""
    step_seconds: float
    """Wall-clock time of the whole step."""
    snow: SnowDiagnostics | None
    """Diagnostics of the snow. None without snow, and before the first step."""
    notices: Notices
    """What makes the results of the session doubtful, counted since the session was made; a fork begins with none."""
    cloth: ClothSteps | None
    """How the step was divided for the cloths. None without cloth, and before the first step."""
    external_work: float
    """Work of the air and of given forces on cloth in the step (J)."""
    loads: tuple[ColliderLoad, ...]
    """What each collider felt in the step, in the order of the scene. Empty without colliders, and before the first
    step."""
    surface: SurfaceReport | None
    """What kept the surfaces of cloth apart. None where no body has a thickness and crossings are not counted, and
    before the first step."""
    rest: RestReport | None
    """How still cloth lies. None where the scene has no `[rest]`, and before the first step."""
