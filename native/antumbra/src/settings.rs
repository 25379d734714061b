//! What the user can choose. The names are those of the add-on and of the command line.

use serde::Serialize;

use crate::error::Error;
use crate::verify::POINTS;

/// How the mesh is refined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum Method {
    /// Every face is cut to the same size: the baseline.
    Uniform,
    /// Adaptive subdivision by differences at the vertices (the paper, §2.2).
    As,
    /// Full discontinuity meshing: all shadow boundaries of all that sends light (Lischinski, Tampieri, Greenberg
    /// 1992), as far as the triangles go.
    Dm,
    /// Adaptive discontinuity meshing: shadow boundaries where they can be noticed (the paper, §3.2).
    Adm,
}

/// How surfaces exchange light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum Transport {
    /// The solver decides from the scene.
    Auto,
    /// One patch after the other shoots its light (the paper, §1; Cohen, Chen, Wallace, Greenberg 1988).
    Shooting,
    /// Links between elements and clusters, solved for all bounces at once (Hanrahan, Salzman, Aupperle 1991).
    Hierarchical,
    /// Every patch looks around along rays, and what is shown is gathered along rays: for very many faces (Malley 1988).
    Rays,
}

/// What the colour attribute holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum Quantity {
    /// Outgoing radiance `B/pi`, emission included.
    Radiosity,
    /// `H/pi`: what a white surface would send.
    Irradiance,
}

/// What is done although a scene does not need it: for tests, which compare.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[expect(clippy::struct_excessive_bools, reason = "each is a switch of its own")]
pub struct Anyway {
    /// Surfaces exchange light even where none of them reflects any to another.
    pub reflection: bool,
    /// What is visible of a source is looked for among all that blocks, wherever it stands.
    pub open_visibility: bool,
    /// What lies at the outside of everything is tested for hiding a source.
    pub outer_faces: bool,
    /// What may come between is looked for even where everything lies at the outside.
    pub occlusion: bool,
    /// Shadow boundaries are looked for even there.
    pub shadow_lines: bool,
    /// Groups of points are put to sources that they face away from.
    pub facing_away: bool,
    /// Sources are looked for even where a single polygon hides all of them.
    pub screens: bool,
    /// Surfaces exchange light however little that is.
    pub second_bounce: bool,
}

impl Anyway {
    /// Nothing is left out.
    pub const EVERYTHING: Self = Self {
        reflection: true,
        open_visibility: true,
        outer_faces: true,
        occlusion: true,
        shadow_lines: true,
        facing_away: true,
        screens: true,
        second_bounce: true,
    };
}

/// What is done at most for the light between surfaces, whatever the scene: for tests, which bake small ones by the million.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Patches that look around, if all surfaces were one square; more in scenes of many faces (`transport/looking.rs`). An
    /// interior of 260,000 triangles is cut into 450,000 by its faces anyway.
    pub patches: f64,
    /// Rays that leave all of them together, at most about: twenty seconds of processor time. Far away what they err by averages
    /// out; beside a patch it does not. In a room of 144,000 triangles that windows light 1e7 left 2.5 % where there is no other
    /// error, at all but the worst places, and 4e7 leave 1.8 %.
    pub rays: f64,
    /// Links that memory has room for: 400 MB of them, and as much for their making.
    pub links: usize,
}

impl Default for Effort {
    fn default() -> Self {
        Self { patches: 20_000.0, rays: 4e7, links: 6_000_000 }
    }
}

/// Settings of one bake.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Settings {
    /// How the mesh is refined.
    pub method: Method,
    /// How surfaces exchange light.
    pub transport: Transport,
    /// Wanted rms error, relative to the mean radiosity of the baked surfaces.
    pub tolerance: f64,
    /// Largest edge of an element before any refinement, in metres; 0 lets the solver choose.
    pub element_size: f64,
    /// How many times an element may be subdivided by the light on it.
    pub max_level: u32,
    /// More blockers than this on one element subdivide it instead of drawing their boundaries (the paper, §3.2, 5a).
    pub max_blockers: u32,
    /// Wall-clock seconds after which the solver finishes what it has; 0 means none.
    pub time_limit: f64,
    /// Most triangles in the baked mesh; 0 leaves it to the solver, which stops at a safety limit of 100,000 plus
    /// three times the triangles before refinement.
    pub triangle_budget: u64,
    /// What the colour attribute holds.
    pub quantity: Quantity,
    /// Whether direct and indirect light are also given apart.
    pub separate_layers: bool,
    /// Random points at which the result is compared with light along random paths, at most; 0 compares nothing. What
    /// that may take grows with them, and is a tenth of the bake at the default.
    pub verify_points: u32,
    /// What is not left out.
    pub anyway: Anyway,
    #[doc(hidden)]
    #[serde(skip)]
    pub effort: Effort,
    /// Worker threads; 0 takes one per core. The result does not depend on it.
    pub threads: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            method: Method::Adm,
            transport: Transport::Auto,
            tolerance: 0.01,
            element_size: 0.0,
            max_level: 8,
            max_blockers: 4,
            time_limit: 0.0,
            triangle_budget: 0,
            quantity: Quantity::Radiosity,
            separate_layers: false,
            verify_points: POINTS,
            anyway: Anyway::default(),
            effort: Effort::default(),
            threads: 0,
        }
    }
}

/// Triangles that refinement may add to a scene when no budget is set, besides [`ADDED_PER_TRIANGLE`]. Adaptive
/// subdivision chases every fine shadow of a detailed interior with millions of elements; four times this is where
/// memory and export formats start to hurt. Simple scenes stay far below.
const AUTOMATIC_LIMIT: usize = 100_000;

/// Triangles that refinement may add for each that was there. In a flat of a million triangles with 128 lamps, at a tolerance
/// of 0.05, half a triangle left the solver's own estimate at 4.1 %, and as many as it asked for at 2.8 %.
const ADDED_PER_TRIANGLE: usize = 2;

/// More points than this tell nothing more, and their light fills the memory.
const MOST_POINTS: u32 = 1_000_000;

impl Settings {
    /// The most triangles that refinement may make of so many.
    pub(crate) fn triangle_limit(&self, coarse_triangles: usize) -> usize {
        match usize::try_from(self.triangle_budget).unwrap_or(usize::MAX) {
            0 => AUTOMATIC_LIMIT + (1 + ADDED_PER_TRIANGLE) * coarse_triangles,
            budget => budget,
        }
    }

    /// Checks every value against its range.
    ///
    /// # Errors
    /// [`Error::InvalidSetting`] names the first setting out of range.
    pub fn validate(&self) -> Result<(), Error> {
        let refuse =
            |name, value: f64, reason| Err(Error::InvalidSetting { name, value: value.to_string(), reason });
        if !(1e-6..=1.0).contains(&self.tolerance) {
            return refuse("tolerance", self.tolerance, "must be between 0.000001 and 1");
        }
        if !(self.element_size >= 0.0 && self.element_size.is_finite()) {
            return refuse("element_size", self.element_size, "must be 0 (automatic) or a length in metres");
        }
        if self.max_level > 16 {
            return refuse("max_level", f64::from(self.max_level), "must be at most 16");
        }
        if !(self.time_limit >= 0.0 && self.time_limit.is_finite()) {
            return refuse("time_limit", self.time_limit, "must be 0 (none) or a number of seconds");
        }
        if self.verify_points > MOST_POINTS {
            return refuse("verify_points", f64::from(self.verify_points), "must be at most 1000000");
        }
        Ok(())
    }
}
