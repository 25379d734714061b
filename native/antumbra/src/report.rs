//! What a bake took and what it is worth, for REPORT.json.

use serde::Serialize;

/// Everything the solver says about one bake. Serialises to the `scene`, `timings`, `timeline`, `result` and
/// `warnings` parts of REPORT.json.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Report {
    /// What came in.
    pub scene: SceneSummary,
    /// Where the time went.
    pub timings: Timings,
    /// What it took of memory.
    pub memory: Memory,
    /// One entry per iteration of the solver.
    pub timeline: Vec<Iteration>,
    /// What came out.
    pub result: ResultSummary,
    /// What the user should know, one clear sentence each.
    pub warnings: Vec<String>,
}

/// Counts of the input.
#[derive(Debug, Clone, Default, Serialize)]
pub struct SceneSummary {
    /// Mesh objects.
    pub objects: usize,
    /// Source triangles.
    pub triangles: usize,
    /// Lights, emitting surfaces, and the sky.
    pub lights: usize,
}

/// Seconds.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Timings {
    /// Wall-clock time of the solver.
    pub solve_s: f64,
}

/// Bytes.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Memory {
    /// The most that was allocated at a time, beyond what was before, as the caller counts it; `None` where nobody does.
    pub peak_bytes: Option<u64>,
}

/// The state after one iteration.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Iteration {
    /// Wall-clock seconds since the solver started.
    pub time_s: f64,
    /// Shots so far.
    pub shots: usize,
    /// Leaf elements.
    pub elements: usize,
    /// Vertices of the mesh.
    pub vertices: usize,
    /// Share of the emitted light that has not been distributed yet.
    pub unshot: f64,
    /// Verified error of what would be shown now, and its 95 % interval, as in [`Verification`]; `None` where the mesh and
    /// its light had not changed, and where nothing was verified.
    pub error: Option<[f64; 3]>,
    /// The same as the solver estimates it; see [`ResultSummary::estimated_error`].
    pub estimated: Option<f64>,
}

/// Counts of the output.
#[derive(Debug, Clone, Default, Serialize)]
pub struct ResultSummary {
    /// Baked triangles.
    pub triangles: usize,
    /// Baked vertices.
    pub vertices: usize,
    /// Why the solver ended: `"converged"`, `"time_limit"`, `"triangle_budget"`,
    /// `"refinement_limit"` (no budget was set, and the mesh reached the solver's own) or `"stopped"`.
    pub ended_by: String,
    /// Share of the light that had not arrived when shooting ended; it was spread like the indirect light before it.
    pub unshot: f64,
    /// Discontinuity lines in the mesh.
    pub lines: LineSummary,
    /// How light was exchanged between surfaces.
    pub transport: TransportSummary,
    /// How visibility was found.
    pub visibility: VisibilitySummary,
    /// What the scene did not need, and was left out.
    pub plan: Vec<LeftOut>,
    /// Rms error, relative to the mean radiosity, by what refinement found in the middles of elements before their vertices
    /// were fitted to it: of what is shown by elements, not of the exchange between surfaces. `None` where the mesh was not
    /// refined for some of the light.
    pub estimated_error: Option<f64>,
    /// What the result differs from light along random paths by; `None` where that was not wanted, and in the dark.
    pub verification: Option<Verification>,
}

/// Discontinuity lines of the methods ADM and DM.
#[derive(Debug, Clone, Default, Serialize)]
pub struct LineSummary {
    /// Shadow boundaries and contacts that went into the mesh, counted per face.
    pub drawn: usize,
    /// Faces whose lines were too many or too tangled to arrange, and which were refined without.
    pub plain_faces: usize,
}

/// The exchange of light between surfaces.
#[derive(Debug, Clone, Default, Serialize)]
pub struct TransportSummary {
    /// `"SHOOTING"`, `"HIERARCHICAL"` or `"RAYS"`: what was used.
    pub mode: String,
    /// Elements that exchanged light, both sides counted.
    pub elements: usize,
    /// Links between them; with shooting, form factors; with rays, what they met.
    pub links: usize,
    /// Iterations of the last solution; with shooting, shots.
    pub iterations: usize,
    /// |absorbed - emitted| / emitted of the exchange, where no light can escape.
    pub imbalance: Option<f64>,
}

/// The result compared with light along random paths, at random points of the baked surfaces. Everything is about the light
/// that is shown, without what surfaces emit themselves, and relative to its mean over the points and channels.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Verification {
    /// Points that were looked at.
    pub points: usize,
    /// Paths of each of the two estimates at a point.
    pub paths: usize,
    /// Rays of all of them.
    pub rays: u64,
    /// Wall-clock seconds.
    pub time_s: f64,
    /// Rms error, and the ends of its 95 % interval.
    pub error: [f64; 3],
    /// Mean error, positive where too much is shown, and the ends of its 95 % interval.
    pub bias: [f64; 3],
    /// 99 of 100 points differ less from their estimates, whose noise is in it.
    pub p99: f64,
    /// Power that arrives on what is baked, less what should, relative to that: like the bias, whatever surfaces reflect.
    pub energy_defect: f64,
    /// Rms noise of the mean of a point's estimates.
    pub noise: f64,
    /// The points, x, y, z in metres, each with its error: positive where too much is shown, relative to the mean over all
    /// points, the noise of the estimates in it.
    pub places: Vec<[f32; 4]>,
}

/// Something that was not done.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LeftOut {
    /// Of the switch in [`crate::settings::Anyway`].
    pub name: &'static str,
    /// What was not done.
    pub what: &'static str,
    /// Why it was not needed.
    pub reason: String,
    /// What that does to the result.
    pub kind: Kind,
    /// What it may add to the rms error, at most, in wanted errors.
    pub bound: f64,
    /// What it would have been.
    pub saved: String,
}

impl LeftOut {
    /// Something that changes nothing.
    pub(crate) fn exact(
        name: &'static str,
        what: &'static str,
        reason: impl Into<String>,
        saved: impl Into<String>,
    ) -> Self {
        Self { name, what, reason: reason.into(), kind: Kind::Exact, bound: 0.0, saved: saved.into() }
    }
}

/// What leaving something out does to the result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Nothing.
    Exact,
    /// It adds an error within a bound.
    Bounded,
}

/// How many form factors were computed in which way.
#[derive(Debug, Clone, Default, Serialize)]
pub struct VisibilitySummary {
    /// Exactly.
    pub exact: u64,
    /// By shadow rays, because too many blockers stood in between.
    pub sampled: u64,
    /// Shadow rays in all.
    pub rays: u64,
    /// Of those found exactly, how many had nothing before their source.
    pub open: u64,
}

impl From<[u64; 4]> for VisibilitySummary {
    fn from([exact, sampled, rays, open]: [u64; 4]) -> Self {
        Self { exact, sampled, rays, open }
    }
}
