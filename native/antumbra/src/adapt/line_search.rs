//! Which shadow boundaries go into the mesh (the paper, §3.2: "shadow boundaries only where necessary, i.e. where they
//! are visible").
//!
//! Every face is put to the five-case test for every emitter, its quarters where the test says so; the wedges of what
//! blocks there are intersected with the face. A line goes in when it earns its place: when leaving it out would cost a
//! noticeable share of the allowed squared error. Contacts are looked for on every face.

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::adapt::five_cases::{Case, Seen, case};
use crate::error::Error;
use crate::index::FaceId;
use crate::mesh::arrangement::{Line, LineKind};
use crate::mesh::grid::{GRID, GridPoint, Step, cross_properly};
use crate::monitor::Monitor;
use crate::scene::world::World;
use crate::shadow::boundary::{Plane, clip_to_triangle, trace};
use crate::shadow::contact::contact_line;
use crate::shadow::silhouette::BlockerEdges;
use crate::shadow::strength::jump;
use crate::shadow::wedge::{Wedge, WedgeCache, WedgeId};
use crate::transport::gather::rms;
use crate::transport::source_tree::LitPolygon;
use crate::visibility::blockers::Blockers;
use crate::visibility::shaft::{Shaft, TRIANGLE_EDGES};
use crate::visibility::{
    ConvexPolygon, Receiver, Scratch, Visibility, unoccluded_form_factor, visible_form_factor,
};

/// Times that a face is quartered in search of elements with few blockers.
const DEEPEST: u32 = 5;

/// Candidates between an element and a source beyond which it is looked at in quarters, or left to subdivision.
const MOST_CANDIDATES: usize = 512;

/// Distance of a polygon from a face's box, relative to the face's size, up to which they are looked at: ten times
/// what counts as touching.
const NEAR: f64 = 1e-5;

/// Where the strength of a line is looked at, along it.
const PROBES: [f64; 3] = [0.15, 0.5, 0.85];

/// Parts of a line that are nearer than this, as a weight, continue each other: rounding of their ends.
const TOUCHING: f64 = 1e-9;

/// Share of the allowed squared error that every vertex of a line must remove. Where bisection ends, with N vertices,
/// one more removes about 2/N of the squared error, since that falls with the square of N; N is of the order of 1000. On
/// the paper's scene ten times more or less changes neither error nor vertices by more than 3 %.
pub(crate) const WORTH_A_VERTEX: f64 = 2e-3;

/// Lines that are this near, in cells of the grid, are one: a millionth of the face, as for what touches.
const SAME_LINE: f64 = 64.0;

/// A line that nowhere leaves an edge of its face by more than this, in cells of the grid, is the edge: four times what
/// counts as touching. Walls that meet in the edge throw such lines, by rounding; the strip between would have light of
/// its own.
const ALONG_BORDER: i32 = 268;

/// What is asked of lines.
pub(crate) struct LineSearch<'a> {
    pub(crate) world: &'a World,
    pub(crate) blockers: &'a Blockers,
    pub(crate) edges: &'a BlockerEdges,
    pub(crate) monitor: &'a Monitor,
    pub(crate) sources: &'a [LitPolygon],
    /// Per material: the share of arriving light that is shown, per channel.
    pub(crate) shown: &'a [DVec3],
    /// Mean radiosity of what is baked, W/m².
    pub(crate) mean_radiosity: f64,
    /// The integral of the squared error that is allowed over all baked surfaces, W²/m².
    pub(crate) allowed: f64,
    /// The user's `max_blockers`.
    pub(crate) max_blockers: usize,
    /// Share of the allowed squared error that a vertex must be worth, or nothing for every line.
    pub(crate) worth: Option<f64>,
}

/// A shadow boundary on a face.
#[derive(Debug, Clone, Copy)]
struct ShadowLine {
    line: Line,
    /// The integral of the squared error that it removes, about, W²/m².
    removes: f64,
}

/// The lines of a scene, and what they are worth.
pub(crate) struct Lines {
    contacts: FxHashMap<FaceId, Vec<Line>>,
    /// Per face, those that remove most first.
    shadows: Vec<(FaceId, Vec<ShadowLine>)>,
    /// Squared error that a vertex must remove, W²/m², or nothing for every line.
    price: Option<f64>,
}

impl Lines {
    /// The contacts, and the shadow boundaries that remove at least as much error as their vertices could elsewhere: two
    /// at their ends and one wherever they cross a stronger one. Vertices become dearer until there are at most `most`.
    pub(crate) fn worthwhile(mut self, most: usize) -> FxHashMap<FaceId, Vec<Line>> {
        loop {
            let (lines, vertices) = self.at_this_price();
            if vertices <= most {
                return lines;
            }
            self.raise_price();
        }
    }

    /// Lines at the current price, with the number of vertices that they make, about.
    fn at_this_price(&self) -> (FxHashMap<FaceId, Vec<Line>>, usize) {
        let mut lines = self.contacts.clone();
        let mut vertices = 0;
        for (face, shadows) in &self.shadows {
            let drawn = lines.entry(*face).or_default();
            for shadow in shadows {
                let ends = shadow.line.ends;
                if drawn.iter().any(|other| lies_along(ends, other.ends)) {
                    continue;
                }
                let makes = 2 + drawn.iter().filter(|other| cross_properly(ends, other.ends)).count();
                if self.price.is_none_or(|price| shadow.removes >= price * makes as f64) {
                    drawn.push(shadow.line);
                    vertices += makes;
                }
            }
        }
        lines.retain(|_, lines| !lines.is_empty());
        (lines, vertices)
    }

    /// The least price is a millionth of what the strongest line removes, and never nothing: where no line removes
    /// anything, as in the dark, the next price leaves all out.
    fn raise_price(&mut self) {
        let strongest =
            self.shadows.iter().filter_map(|(_, found)| Some(found.first()?.removes)).fold(0.0, f64::max);
        let least = (1e-6 * strongest).max(f64::MIN_POSITIVE);
        self.price = Some(self.price.map_or(least, |price| (4.0 * price).max(least)));
    }
}

/// Whether a line runs along another, nearer than [`SAME_LINE`]: the plane of a wall throws one where the wall touches
/// the floor, and a sliver between the two would carry light into the wall.
fn lies_along(line: [GridPoint; 2], other: [GridPoint; 2]) -> bool {
    let near = |p: GridPoint| {
        let (along, to) = (Step::between(other[0], other[1]), Step::between(other[0], p));
        let length = (along.length_squared() as f64).sqrt();
        let t = along.dot(to) as f64 / length;
        (along.cross(to) as f64).abs() <= SAME_LINE * length && (-SAME_LINE..=length + SAME_LINE).contains(&t)
    };
    near(line[0]) && near(line[1])
}

/// Part of a wedge's line on a face: barycentric ends.
type Part = [DVec3; 2];

/// A face under search.
struct Plate<'a> {
    corners: [DVec3; 3],
    normal: DVec3,
    plane: Plane,
    /// From its centre to its farthest corner and beyond, metres.
    reach: f64,
    area: f64,
    shown: &'a DVec3,
}

impl Plate<'_> {
    fn at(&self, weights: DVec3) -> DVec3 {
        weights.x * self.corners[0] + weights.y * self.corners[1] + weights.z * self.corners[2]
    }

    fn receiver(&self, position: DVec3) -> Receiver {
        Receiver { position, normal: self.normal }
    }
}

/// What a thread keeps from face to face.
struct Workspace<'a> {
    wedges: Vec<WedgeCache<'a>>,
    scratch: Scratch,
    found: Vec<u32>,
}

impl<'a> LineSearch<'a> {
    /// The lines of every baked face that has any.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn find(&'a self) -> Result<Lines, Error> {
        let faces: Vec<FaceId> =
            FaceId::range(0..self.world.faces.len()).filter(|&face| self.world.receives(face)).collect();
        let workspace = || Workspace {
            wedges: (self.sources.iter())
                .map(|source| WedgeCache::new(&source.polygon, self.edges, self.blockers.polygons()))
                .collect(),
            scratch: Scratch::new(),
            found: Vec::new(),
        };
        let found: Vec<Vec<ShadowLine>> = (faces.par_iter())
            .map_init(workspace, |workspace, &face| {
                if self.monitor.wants_end() { Vec::new() } else { self.lines_of(face, workspace) }
            })
            .collect();
        self.monitor.check()?;
        let shadows = faces.into_iter().zip(found).filter(|(_, found)| !found.is_empty()).collect();
        let receives = |face| self.world.receives(face);
        let contacts = contacts(self.world, self.blockers, receives, self.shortest_contact());
        Ok(Lines { contacts, shadows, price: self.worth.map(|worth| worth * self.allowed) })
    }

    /// The light jumps by about its mean across a contact, and without the line would be wrong over about its length
    /// in square.
    fn shortest_contact(&self) -> f64 {
        self.worth.map_or(0.0, |worth| (worth * self.allowed).sqrt() / self.mean_radiosity)
    }

    fn lines_of(&'a self, id: FaceId, workspace: &mut Workspace<'a>) -> Vec<ShadowLine> {
        let face = &self.world.faces[id.index()];
        let corners = self.world.corners(face);
        let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
        let reach = corners.iter().map(|c| c.distance(centre)).fold(0.0, f64::max);
        let plate = Plate {
            corners,
            normal: face.normal,
            plane: Plane { point: centre, normal: face.normal },
            reach: 1.01 * reach,
            area: face.area,
            shown: &self.shown[face.material as usize],
        };
        let mut found = Vec::new();
        for source in 0..self.sources.len() {
            let whole = [DVec3::X, DVec3::Y, DVec3::Z];
            let mut parts: FxHashMap<WedgeId, (Wedge, Vec<Part>)> = FxHashMap::default();
            self.search(&plate, whole, source, 0, workspace, &mut parts);
            let mut parts: Vec<_> = parts.into_iter().collect();
            parts.sort_unstable_by_key(|(id, _)| *id);
            for (_, (wedge, parts)) in parts {
                for part in joined(parts) {
                    if let Some(line) = line(part, LineKind::Shadow) {
                        let removes = self.removes(&plate, &wedge, part, source, workspace);
                        found.push(ShadowLine { line, removes });
                    }
                }
            }
        }
        found.sort_by(|a, b| b.removes.total_cmp(&a.removes).then(a.line.cmp(&b.line)));
        found
    }

    /// Puts a part of a face to the five-case test, and its quarters where that says so.
    fn search(
        &self,
        plate: &Plate,
        part: [DVec3; 3],
        source: usize,
        level: u32,
        workspace: &mut Workspace<'a>,
        lines: &mut FxHashMap<WedgeId, (Wedge, Vec<Part>)>,
    ) {
        let lit = &self.sources[source];
        let corners = part.map(|weights| plate.at(weights));
        let most = (corners.iter())
            .map(|&corner| unoccluded_form_factor(&plate.receiver(corner), &lit.polygon))
            .fold(0.0, f64::max);
        let area = plate.area * 0.25_f64.powi(level as i32);
        let slight = match self.worth {
            _ if most == 0.0 && (0..3).all(|k| !above(&lit.polygon, plate, corners[k])) => true,
            Some(worth) => {
                let difference = rms(*plate.shown * most * lit.radiosity);
                difference * difference * area < worth * self.allowed
            }
            None => false,
        };
        workspace.found.clear();
        let listed = slight || {
            let plane = Some((corners[0], plate.normal));
            let shaft = Shaft::new(&corners, &TRIANGLE_EDGES, &lit.polygon, plane);
            self.blockers.candidates(&shaft, MOST_CANDIDATES, &mut workspace.found).is_ok()
        };
        let candidates = workspace.found.clone();
        let may_descend = level < DEEPEST;
        let case = if listed {
            let seen = corners.map(|corner| self.seen(plate, corner, lit, &candidates, workspace));
            case(slight, &seen, candidates.len(), self.max_blockers, may_descend && self.worth.is_some())
        } else if may_descend {
            Case::Crossed
        } else {
            // A crowd that no list holds is left to subdivision.
            Case::Visible
        };
        match case {
            Case::Hidden | Case::Visible | Case::Slight => {}
            Case::Crossed => {
                for quarter in quarters(part) {
                    self.search(plate, quarter, source, level + 1, workspace, lines);
                }
            }
            Case::Split => {
                for &blocker in &candidates {
                    for wedge in workspace.wedges[source].wedges(blocker) {
                        let segment = trace(wedge, &plate.plane, plate.reach)
                            .and_then(|ends| clip_to_triangle(ends, corners));
                        let Some(ends) = segment else { continue };
                        let ends = ends.map(|w| w.x * part[0] + w.y * part[1] + w.z * part[2]);
                        let (_, parts) = lines.entry(wedge.id).or_insert_with(|| (wedge.clone(), Vec::new()));
                        if !parts.contains(&ends) {
                            parts.push(ends);
                        }
                    }
                }
            }
        }
    }

    /// What a point of a face sees of a source.
    fn seen(
        &self,
        plate: &Plate,
        position: DVec3,
        lit: &LitPolygon,
        candidates: &[u32],
        workspace: &mut Workspace,
    ) -> Seen {
        // Most elements see all of it, and need not be asked.
        if candidates.is_empty() {
            return Seen { state: Visibility::Visible, blockers: Vec::new() };
        }
        let polygons = self.blockers.polygons();
        let receiver = plate.receiver(position);
        match visible_form_factor(&receiver, &lit.polygon, polygons, candidates, &mut workspace.scratch) {
            Ok(found) => Seen { state: found.state, blockers: workspace.scratch.blockers().to_vec() },
            Err(_) => Seen { state: Visibility::Partial, blockers: candidates.to_vec() },
        }
    }

    /// The integral of the squared error that a line removes, about, W²/m².
    fn removes(
        &self,
        plate: &Plate,
        wedge: &Wedge,
        part: Part,
        source: usize,
        workspace: &mut Workspace,
    ) -> f64 {
        let lit = &self.sources[source];
        let ends = part.map(|weights| plate.at(weights));
        let along = ends[1] - ends[0];
        let length = along.length();
        let across = plate.normal.cross(along).normalize_or_zero();
        // The penumbra is as wide as it takes the line's trace to sweep over the source.
        let height = |point: DVec3| plate.normal.dot(point - plate.plane.point);
        let source_height = 0.5 * (height(wedge.from[0]) + height(wedge.from[1]));
        let blocker_height =
            wedge.through.iter().map(|&p| height(p).max(0.0)).sum::<f64>() / wedge.through.len() as f64;
        let diameter = 2.0 * (lit.polygon.area() / std::f64::consts::PI).sqrt();
        let width =
            (diameter * blocker_height / (source_height - blocker_height).max(1e-12)).min(plate.reach);
        let size = width.min(length);
        let strongest = PROBES
            .iter()
            .map(|&t| {
                let middle = ends[0] + t * along;
                let bound = jump(wedge, &plate.receiver(middle), &lit.polygon, self.edges).bound(size);
                if bound == 0.0 {
                    return 0.0;
                }
                let points = [middle - size * across, middle, middle + size * across];
                let shaft = Shaft::new(&points, &TRIANGLE_EDGES, &lit.polygon, None);
                if self.blockers.candidates(&shaft, MOST_CANDIDATES, &mut workspace.found).is_err() {
                    return 0.0;
                }
                let found = std::mem::take(&mut workspace.found);
                let values = points.map(|p| {
                    let receiver = plate.receiver(p);
                    let polygons = self.blockers.polygons();
                    visible_form_factor(&receiver, &lit.polygon, polygons, &found, &mut workspace.scratch)
                        .map_or(0.0, |found| found.value)
                });
                workspace.found = found;
                bound.min(0.25 * (values[0] + values[2] - 2.0 * values[1]).abs())
            })
            .fold(0.0, f64::max);
        let error = rms(*plate.shown * strongest * lit.radiosity);
        error * error * width * length
    }
}

/// Where polygons touch or pierce the faces for which `which` holds, in lines longer than `shortest`, metres.
pub(crate) fn contacts(
    world: &World,
    blockers: &Blockers,
    which: impl Fn(FaceId) -> bool + Sync,
    shortest: f64,
) -> FxHashMap<FaceId, Vec<Line>> {
    let faces: Vec<FaceId> = FaceId::range(0..world.faces.len()).filter(|&face| which(face)).collect();
    let lines: Vec<Vec<Line>> = (faces.par_iter())
        .map_init(Vec::new, |found, &id| {
            let face = &world.faces[id.index()];
            let corners = world.corners(face);
            let [a, b, c] = corners;
            let size = a.distance(b).max(b.distance(c)).max(c.distance(a));
            if size < shortest {
                return Vec::new();
            }
            blockers.touching(a.min(b).min(c), a.max(b).max(c), NEAR * size, found);
            let at = |weights: DVec3| weights.x * a + weights.y * b + weights.z * c;
            (found.iter())
                .flat_map(|&blocker| {
                    contact_line(corners, face.normal, &blockers.polygons()[blocker as usize])
                })
                .filter(|part| at(part[0]).distance(at(part[1])) >= shortest)
                .filter_map(|part| line(part, LineKind::Contact))
                .collect()
        })
        .collect();
    faces.into_iter().zip(lines).filter(|(_, lines)| !lines.is_empty()).collect()
}

/// Whether any part of a source is above a face, and the point in front of the source.
fn above(source: &ConvexPolygon, plate: &Plate, point: DVec3) -> bool {
    source.normal().dot(point - source.vertices()[0]) > 0.0
        && source.vertices().iter().any(|&v| plate.normal.dot(v - point) > 0.0)
}

fn quarters([a, b, c]: [DVec3; 3]) -> [[DVec3; 3]; 4] {
    let [ab, bc, ca] = [0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)];
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}

/// Parts of one line, with those that touch made one.
fn joined(mut parts: Vec<Part>) -> Vec<Part> {
    if parts.len() < 2 {
        return parts;
    }
    // Along the weight that changes most
    let change = parts.iter().fold(DVec3::ZERO, |change, [a, b]| change.max((*b - *a).abs()));
    let axis = (1..3).fold(0, |most, axis| if change[axis] > change[most] { axis } else { most });
    for part in &mut parts {
        if part[0][axis] > part[1][axis] {
            part.swap(0, 1);
        }
    }
    parts.sort_by(|a, b| a[0][axis].total_cmp(&b[0][axis]));
    let mut whole: Vec<Part> = Vec::new();
    for part in parts {
        match whole.last_mut() {
            Some(last) if part[0][axis] <= last[1][axis] + TOUCHING => {
                if part[1][axis] > last[1][axis] {
                    last[1] = part[1];
                }
            }
            _ => whole.push(part),
        }
    }
    whole
}

/// A line on the face's grid; none when it is shorter than the grid can hold, or runs along the border.
fn line(part: Part, kind: LineKind) -> Option<Line> {
    let ends = part.map(|weights| {
        let on_edge = (0..3).find(|&k| weights[(k + 2) % 3] == 0.0);
        let cells = |weight: f64| ((weight * f64::from(GRID)).round() as i32).clamp(0, GRID);
        if let Some(k) = on_edge {
            return GridPoint::on_edge(k, cells(weights[(k + 1) % 3]));
        }
        let u = cells(weights.y);
        GridPoint { u, v: cells(weights.z).min(GRID - u) }
    });
    let along_border = (0..3).any(|k| ends.iter().all(|end| end.depth(k) <= ALONG_BORDER));
    (ends[0] != ends[1] && !along_border).then_some(Line { ends, kind })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In the dark no line removes anything and vertices cost nothing; too many lines must still come to an end.
    #[test]
    fn lines_that_remove_nothing_give_way_to_the_budget() {
        for price in [None, Some(0.0)] {
            let ends = [GridPoint { u: 1000, v: 1000 }, GridPoint { u: 9_000_000, v: 1000 }];
            let shadow = ShadowLine { line: Line { ends, kind: LineKind::Shadow }, removes: 0.0 };
            let lines = Lines {
                contacts: FxHashMap::default(),
                shadows: vec![(FaceId::new(0), vec![shadow])],
                price,
            };
            assert!(lines.worthwhile(1).is_empty());
        }
    }
}
