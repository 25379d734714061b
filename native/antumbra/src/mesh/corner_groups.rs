//! Which corners share a sample.
//!
//! Around a vertex, corners with the same shading normal form a group: a smooth fan, or flat faces in one plane.
//! One sample serves the group; a crease separates groups.

use glam::DVec3;
use smallvec::SmallVec;

use crate::index::SampleId;
use crate::mesh::{ONE_SIDED_STEP, Sample};
use crate::scene::world::{SAME_NORMAL, World};

/// One group of corners while it is being collected.
struct Group {
    vertex: u32,
    normal: DVec3,
    towards_centroids: DVec3,
    corners: u32,
    rim: Rim,
}

/// The edges from a vertex that only one of the corners around it has so far, by their other ends. Empty once the
/// corners lie all around the vertex.
#[derive(Debug, Clone, Default)]
pub(super) struct Rim(SmallVec<[u32; 4]>);

impl Rim {
    /// Adds a corner, given the other ends of its two edges.
    pub(super) fn add(&mut self, ends: [u32; 2]) {
        for end in ends {
            if let Some(at) = self.0.iter().position(|&open| open == end) {
                self.0.swap_remove(at);
            } else {
                self.0.push(end);
            }
        }
    }

    pub(super) fn is_open(&self) -> bool {
        !self.0.is_empty()
    }
}

/// The samples of a scene's faces before any subdivision, and for every face its corners' samples.
pub(super) fn group_corners(world: &World) -> (Vec<Sample>, Vec<[SampleId; 3]>) {
    let mut groups: Vec<Group> = Vec::new();
    // Per vertex: its newest group. Per group: the vertex's previous one.
    let mut newest: Vec<Option<usize>> = vec![None; world.vertices.len()];
    let mut previous: Vec<Option<usize>> = Vec::new();
    let mut corner_samples = Vec::with_capacity(world.faces.len());
    for face in &world.faces {
        let corners = world.corners(face);
        let centroid = (corners[0] + corners[1] + corners[2]) / 3.0;
        corner_samples.push(std::array::from_fn(|k| {
            let vertex = face.vertices[k];
            let normal = face.corner_normals.map_or(face.normal, |normals| normals[k]);
            let mut at = newest[vertex as usize];
            while let Some(group) = at.filter(|&g| groups[g].normal.distance_squared(normal) > SAME_NORMAL) {
                at = previous[group];
            }
            let group = at.unwrap_or_else(|| {
                groups.push(Group {
                    vertex,
                    normal,
                    towards_centroids: DVec3::ZERO,
                    corners: 0,
                    rim: Rim::default(),
                });
                previous.push(newest[vertex as usize].replace(groups.len() - 1));
                groups.len() - 1
            });
            groups[group].towards_centroids += centroid - corners[k];
            groups[group].corners += 1;
            groups[group].rim.add([face.vertices[(k + 1) % 3], face.vertices[(k + 2) % 3]]);
            SampleId::new(group)
        }));
    }
    let samples = groups
        .iter()
        .map(|group| Sample {
            position: world.vertices[group.vertex as usize],
            normal: group.normal,
            inward: group.towards_centroids * (ONE_SIDED_STEP / f64::from(group.corners)),
            one_sided: group.rim.is_open(),
            in_plane: false,
            object: world.object_of_vertex(group.vertex),
            parents: None,
        })
        .collect();
    (samples, corner_samples)
}
