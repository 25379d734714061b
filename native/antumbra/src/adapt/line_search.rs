//! Where shadow boundaries are (the paper, §3.2): every face is put to the five-case test for every source, its quarters
//! where the test says so, and the wedges of what blocks there are intersected with the face.
//!
//! Which of the lines are drawn is for [`super::line_choice`] to say. Here only those are left out that cannot be: what
//! could never remove as much error as its vertices must is not looked for.

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::adapt::five_cases::{Case, Seen as SeenAt, case};
use crate::adapt::line_choice::{ENDS, ShadowLine};
use crate::adapt::line_sources::LineSource;
use crate::adapt::line_strength::Strength;
use crate::adapt::plate::{Part, Plate, TOUCHING, joined, line};
use crate::error::Error;
use crate::index::FaceId;
use crate::mesh::arrangement::LineKind;
use crate::monitor::Monitor;
use crate::scene::world::{World, interpolated};
use crate::shadow::boundary::{clip_to_triangle, trace};
use crate::shadow::silhouette::BlockerEdges;
use crate::shadow::wedge::{WedgeCache, WedgeId};
use crate::threads::AT_A_TIME;
use crate::transport::clusters::{CLUSTER_SIZE, clusters};
use crate::transport::gather::rms;
use crate::visibility::blockers::Blockers;
use crate::visibility::screens::{Body, Unscreened};
use crate::visibility::shaft::{Shaft, TRIANGLE_EDGES};
use crate::visibility::{
    ConvexPolygon, Receiver, Scratch, Visibility, unoccluded_form_factor, visible_weighted,
};

/// Times that a face is quartered in search of elements with few blockers.
const DEEPEST: u32 = 5;

/// Candidates between an element and a source beyond which it is looked at in quarters, or left to subdivision.
pub(super) const MOST_CANDIDATES: usize = 512;

/// Candidates of an element up to which its quarters look for theirs among them; the tree finds fewer of many sooner.
const FEW_CANDIDATES: usize = 64;

/// What is asked of lines.
pub(crate) struct LineSearch<'a> {
    pub(crate) world: &'a World,
    pub(crate) blockers: &'a Blockers,
    pub(crate) edges: &'a BlockerEdges,
    pub(crate) monitor: &'a Monitor,
    /// When to leave it at the lines found so far.
    pub(crate) ends: &'a (dyn Fn() -> bool + Sync),
    /// Per material: the share of arriving light that is shown, per channel.
    pub(crate) shown: &'a [DVec3],
    /// The integral of the squared error that is allowed over all baked surfaces, W²/m².
    pub(crate) allowed: f64,
    /// The user's `max_blockers`.
    pub(crate) max_blockers: usize,
    /// Squared error that a vertex must remove, W²/m², or nothing for every line.
    pub(crate) price: Option<f64>,
}

/// Which faces may see which sources: not those that a single polygon hides it from.
pub(super) struct Seen {
    /// Per face, where it comes among neighbours.
    places: Vec<u32>,
    unscreened: Unscreened,
}

impl Seen {
    pub(super) fn new(search: &LineSearch, faces: &[FaceId], sources: &[Body]) -> Self {
        let corners = |face: FaceId| search.world.corners(&search.world.faces[face.index()]);
        let middles: Vec<Receiver> = (faces.iter())
            .map(|&face| Receiver::new(corners(face).iter().sum::<DVec3>() / 3.0, DVec3::Z))
            .collect();
        let order: Vec<u32> =
            clusters(&middles, CLUSTER_SIZE).into_iter().flat_map(|cluster| cluster.members).collect();
        let mut places = vec![0; faces.len()];
        let mut bounds = Vec::with_capacity(faces.len());
        for (place, face) in (0..).zip(order) {
            places[face as usize] = place;
            let [a, b, c] = corners(faces[face as usize]);
            bounds.push((a.min(b).min(c), a.max(b).max(c)));
        }
        Self { places, unscreened: Unscreened::new(search.blockers, &bounds, sources) }
    }

    /// The sources that a face may see, in order.
    pub(super) fn of(&self, face: usize) -> &[u32] {
        self.unscreened.of(self.places[face] as usize)
    }

    /// Per source: the faces that may see it, in order.
    fn by_source(&self, sources: usize) -> Vec<Vec<u32>> {
        let mut faces = vec![Vec::new(); sources];
        for face in 0..self.places.len() {
            self.of(face).iter().for_each(|&source| faces[source as usize].push(face as u32));
        }
        faces
    }
}

/// A source, with what is kept while it shoots.
struct Shooter<'a> {
    source: &'a LineSource,
    wedges: WedgeCache<'a>,
    /// Distance of its farthest corner from its centroid, metres.
    radius: f64,
}

impl Shooter<'_> {
    fn polygon(&self) -> &ConvexPolygon {
        &self.source.lit.polygon
    }

    /// No form factor to any point of a face is larger.
    fn most(&self, plate: &Plate) -> f64 {
        let distance = plate.plane.point.distance(self.polygon().centroid()) - plate.reach - self.radius;
        let distance = distance.max(0.0);
        (self.polygon().area() / (std::f64::consts::PI * distance * distance)).min(1.0)
    }

    /// Whether any part of it is above a face, and one of the points in front of it.
    fn lights(&self, plate: &Plate, mut points: impl Iterator<Item = DVec3>) -> bool {
        let vertices = self.polygon().vertices();
        vertices.iter().any(|&v| plate.plane.normal.dot(v - plate.plane.point) > 0.0)
            && points.any(|point| self.polygon().normal().dot(point - vertices[0]) > 0.0)
    }
}

/// A corner of a part of a face, asked once for all parts around it.
struct Corner {
    weights: DVec3,
    position: DVec3,
    /// Whichever side of the source it is on.
    unoccluded: f64,
    seen: Option<SeenAt>,
}

/// Where a wedge meets the plane of the face.
struct Traced {
    /// Among the blocker's wedges.
    wedge: u32,
    /// Metres.
    ends: [DVec3; 2],
    /// What of it is on the face.
    on_face: Part,
}

/// A piece of a line on a part of the face.
struct Piece {
    id: WedgeId,
    blocker: u32,
    /// Among the blocker's wedges.
    wedge: u32,
    ends: Part,
}

/// A face and a source, with what was found about them.
struct Walk<'w> {
    plate: &'w Plate,
    shooter: &'w Shooter<'w>,
    corners: Vec<Corner>,
    traced: FxHashMap<u32, Vec<Traced>>,
    pieces: Vec<Piece>,
}

impl LineSearch<'_> {
    /// The lines of every baked face that could be worth drawing.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn find(&self, sources: &[LineSource]) -> Result<Vec<(FaceId, Vec<ShadowLine>)>, Error> {
        let mut lines: Vec<(FaceId, Vec<ShadowLine>)> = FaceId::range(0..self.world.faces.len())
            .filter(|&face| self.world.receives(face))
            .map(|face| (face, Vec::new()))
            .collect();
        let could_pay = |source: &LineSource| self.price.is_none_or(|price| source.most >= ENDS * price);
        let faces: Vec<FaceId> = lines.iter().map(|(face, _)| *face).collect();
        let bodies =
            sources.iter().map(|source| Some(source.lit.polygon.vertices().iter().copied().collect()));
        let seen = Seen::new(self, &faces, &bodies.collect::<Vec<Body>>()).by_source(sources.len());
        for (source, seen) in sources.iter().zip(seen).filter(|(source, _)| could_pay(source)) {
            if (self.ends)() {
                break;
            }
            let (polygon, polygons) = (&source.lit.polygon, self.blockers.polygons());
            let centre = polygon.centroid();
            let shooter = Shooter {
                source,
                wedges: WedgeCache::new(polygon, self.edges, polygons),
                radius: polygon.vertices().iter().map(|v| v.distance(centre)).fold(0.0, f64::max),
            };
            let strength = || Strength {
                blockers: self.blockers,
                edges: self.edges,
                scratch: Scratch::new(),
                found: Vec::new(),
            };
            let found: Vec<(u32, Vec<ShadowLine>)> =
                (seen.into_par_iter().with_min_len(AT_A_TIME).with_max_len(AT_A_TIME))
                    .map_init(strength, |strength, face| {
                        let mut lines = Vec::new();
                        if !(self.ends)() {
                            self.add_lines(faces[face as usize], &shooter, strength, &mut lines);
                        }
                        (face, lines)
                    })
                    .filter(|(_, lines)| !lines.is_empty())
                    .collect();
            self.monitor.check()?;
            for (face, found) in found {
                lines[face as usize].1.extend(found);
            }
        }
        lines.retain(|(_, lines)| !lines.is_empty());
        Ok(lines)
    }

    /// Adds the lines of one source on one face.
    fn add_lines(&self, id: FaceId, shooter: &Shooter, strength: &mut Strength, lines: &mut Vec<ShadowLine>) {
        let plate = Plate::new(self, id);
        if !shooter.lights(&plate, plate.corners.into_iter())
            || self.is_slight(&plate, shooter, shooter.most(&plate), plate.area)
        {
            return;
        }
        let mut walk = Walk {
            plate: &plate,
            shooter,
            corners: Vec::new(),
            traced: FxHashMap::default(),
            pieces: Vec::new(),
        };
        let whole = [DVec3::X, DVec3::Y, DVec3::Z].map(|weights| walk.add_corner(weights));
        self.search(&mut walk, whole, 0, None, strength);

        // One line of each wedge, from all parts of the face
        let mut pieces = walk.pieces;
        pieces.sort_by_key(|piece| piece.id);
        let lit = &shooter.source.lit;
        for pieces in pieces.chunk_by(|a, b| a.id == b.id) {
            let wedge = &shooter.wedges.wedges(pieces[0].blocker)[pieces[0].wedge as usize];
            for part in joined(pieces.iter().map(|piece| piece.ends).collect()) {
                let Some(line) = line(part, LineKind::Shadow) else { continue };
                let least = self.price.map(|price| ENDS * price);
                let removes = strength.removes(&plate, wedge, part, lit, least);
                if least.is_none_or(|least| removes >= least) {
                    lines.push(ShadowLine::new(line, removes, self.allowed));
                }
            }
        }
    }

    /// Whether no difference that the source can make on an area matters.
    fn is_slight(&self, plate: &Plate, shooter: &Shooter, form_factor: f64, area: f64) -> bool {
        let difference = rms(plate.shown * form_factor * shooter.source.lit.radiosity);
        self.price.is_some_and(|price| difference * difference * area < price)
    }

    /// Puts a part of a face to the five-case test, and its quarters where that says so.
    ///
    /// `known`: what may block between the source and the part, or more than that.
    fn search(
        &self,
        walk: &mut Walk,
        part: [usize; 3],
        level: u32,
        known: Option<&[u32]>,
        strength: &mut Strength,
    ) {
        let (plate, shooter) = (walk.plate, walk.shooter);
        let corners = part.map(|corner| walk.corners[corner].position);
        let most = part.iter().map(|&corner| walk.corners[corner].unoccluded).fold(0.0, f64::max);
        let area = plate.area * 0.25_f64.powi(level as i32);
        if !shooter.lights(plate, corners.into_iter()) || self.is_slight(plate, shooter, most, area) {
            return;
        }
        let candidates = self.candidates(plate, shooter, corners, known);
        let may_descend = level < DEEPEST;
        let case = match &candidates {
            Some(candidates) if candidates.is_empty() => Case::Visible,
            Some(candidates) => {
                let seen = part.map(|corner| self.seen(walk, corner, candidates, strength));
                let quarters_help = may_descend && self.price.is_some();
                case(false, &seen, candidates.len(), self.max_blockers, quarters_help)
            }
            None if may_descend => Case::Crossed,
            // A crowd that no list holds is left to subdivision.
            None => Case::Visible,
        };
        match case {
            Case::Hidden | Case::Visible | Case::Slight => {}
            Case::Crossed => {
                let few = candidates.as_deref().filter(|candidates| candidates.len() <= FEW_CANDIDATES);
                for quarter in walk.quarters(part) {
                    if !(self.ends)() {
                        self.search(walk, quarter, level + 1, few, strength);
                    }
                }
            }
            Case::Split => {
                for &blocker in candidates.as_deref().unwrap_or_default() {
                    walk.cut(blocker, part);
                }
            }
        }
    }

    /// What may come between a part of a face and the source; none when that is too much.
    fn candidates(
        &self,
        plate: &Plate,
        shooter: &Shooter,
        corners: [DVec3; 3],
        known: Option<&[u32]>,
    ) -> Option<Vec<u32>> {
        if known.is_some_and(<[u32]>::is_empty) {
            return Some(Vec::new());
        }
        let shaft =
            Shaft::new(&corners, &TRIANGLE_EDGES, shooter.polygon(), Some((corners[0], plate.plane.normal)));
        if let Some(known) = known {
            let polygons = self.blockers.polygons();
            let may_block = |&&blocker: &&u32| shaft.may_block(&polygons[blocker as usize]);
            return Some(known.iter().filter(may_block).copied().collect());
        }
        let mut found = Vec::new();
        self.blockers.candidates(&shaft, MOST_CANDIDATES, &mut found).ok().map(|()| found)
    }

    /// What a corner sees of the source.
    fn seen(&self, walk: &mut Walk, corner: usize, candidates: &[u32], strength: &mut Strength) -> SeenAt {
        let Walk { plate, shooter, corners, .. } = walk;
        let corner = &mut corners[corner];
        (corner.seen)
            .get_or_insert_with(|| {
                let (receiver, blocking) = (plate.receiver(corner.position), self.blockers.blocking());
                let scratch = &mut strength.scratch;
                match visible_weighted(&receiver, shooter.polygon(), None, blocking, candidates, scratch) {
                    Ok(found) => SeenAt { state: found.state, blockers: scratch.blockers().to_vec() },
                    Err(_) => SeenAt { state: Visibility::Partial, blockers: candidates.to_vec() },
                }
            })
            .clone()
    }
}

impl Walk<'_> {
    fn add_corner(&mut self, weights: DVec3) -> usize {
        let position = self.plate.at(weights);
        let receiver = self.plate.receiver(position);
        let unoccluded = unoccluded_form_factor(&receiver, self.shooter.polygon());
        self.corners.push(Corner { weights, position, unoccluded, seen: None });
        self.corners.len() - 1
    }

    fn quarters(&mut self, [a, b, c]: [usize; 3]) -> [[usize; 3]; 4] {
        let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[from, to]| {
            let weights = 0.5 * (self.corners[from].weights + self.corners[to].weights);
            self.add_corner(weights)
        });
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    }

    /// Collects the lines of a blocker on a part of the face.
    fn cut(&mut self, blocker: u32, part: [usize; 3]) {
        let Self { plate, shooter, corners, traced, pieces } = self;
        let wedges = shooter.wedges.wedges(blocker);
        let traced = traced.entry(blocker).or_insert_with(|| {
            let throw = (0..).zip(wedges).filter(|(_, wedge)| shooter.source.throws(wedge.id));
            throw
                .filter_map(|(index, wedge)| {
                    let ends = trace(wedge, &plate.plane, plate.reach)?;
                    let on_face = clip_to_triangle(ends, plate.corners)?;
                    Some(Traced { wedge: index, ends, on_face })
                })
                .collect()
        });
        let weights = part.map(|corner| corners[corner].weights);
        let positions = part.map(|corner| corners[corner].position);
        let low = weights[0].min(weights[1]).min(weights[2]) - TOUCHING;
        let high = weights[0].max(weights[1]).max(weights[2]) + TOUCHING;
        for Traced { wedge, ends, on_face: [start, end] } in traced {
            if start.max(*end).cmplt(low).any() || start.min(*end).cmpgt(high).any() {
                continue;
            }
            let Some(ends) = clip_to_triangle(*ends, positions) else { continue };
            let ends = ends.map(|end| interpolated(weights, end));
            let id = wedges[*wedge as usize].id;
            pieces.push(Piece { id, blocker, wedge: *wedge, ends });
        }
    }
}
