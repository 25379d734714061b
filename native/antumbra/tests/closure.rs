//! Closure: from any point in an enclosure, the visible form factors of all polygons sum to 1.
//!
//! The strongest test there is: whatever is hidden must be seen elsewhere, exactly once.

mod common;

use antumbra::visibility::{ConvexPolygon, Receiver, Scratch, visible_form_factor};
use common::{Random, Solid, point_in};
use glam::{DMat3, DVec3};

const POINTS_PER_ROOM: usize = 40;
const TOLERANCE: f64 = 1e-12;

/// A closed scene: every polygon both lights and blocks.
struct Room {
    polygons: Vec<ConvexPolygon>,
    enclosure: Solid,
    /// Solids with coplanar faces that overlap, which only count once where one of them is hidden: seen from outside.
    opaque: Vec<Solid>,
}

impl Room {
    /// A cube, tetrahedron or prism, turned and stretched, its faces whole or triangulated.
    fn random(random: &mut Random) -> Self {
        let shape = match random.below(4) {
            0 => Solid::tetrahedron(),
            1 => Solid::prism(3),
            2 => Solid::prism(5),
            _ => Solid::cube(),
        };
        let stretch =
            DVec3::new(random.between(0.5, 3.0), random.between(0.5, 3.0), random.between(0.5, 3.0));
        let rotation = random.rotation();
        let upright = random.below(3) == 0;
        let enclosure =
            shape.map(|corner| if upright { corner * stretch } else { rotation * (corner * stretch) });
        let mut room = Self { polygons: Vec::new(), enclosure: enclosure.clone(), opaque: Vec::new() };
        room.add(&enclosure, random);
        room
    }

    fn add(&mut self, solid: &Solid, random: &mut Random) {
        if random.below(2) == 0 {
            self.polygons.extend(solid.polygons());
        } else {
            self.polygons.extend(solid.triangles(random));
        }
    }

    fn point_inside(&self, random: &mut Random) -> DVec3 {
        point_in(&self.enclosure.corners, random)
    }

    /// The sum of all visible form factors.
    fn closure(&self, receiver: &Receiver, scratch: &mut Scratch) -> f64 {
        let candidates: Vec<u32> = (0..self.polygons.len() as u32).collect();
        let mut sum = 0.0;
        for source in &self.polygons {
            sum += visible_form_factor(receiver, source, &self.polygons, &candidates, scratch)
                .expect("these rooms are simple")
                .value;
        }
        sum
    }

    /// A receiver in the open, facing anywhere, or on any surface, facing to either side.
    fn receiver(&self, random: &mut Random) -> Receiver {
        loop {
            let receiver = if random.below(2) == 0 {
                Receiver::new(self.point_inside(random), random.direction())
            } else {
                let polygon = &self.polygons[random.below(self.polygons.len())];
                let side = [-1.0, 1.0][random.below(2)];
                Receiver::new(point_in(polygon.vertices(), random), polygon.normal() * side)
            };
            let above = receiver.position + 1e-6 * receiver.normal;
            if self.enclosure.contains(above) && !self.opaque.iter().any(|solid| solid.contains(above)) {
                return receiver;
            }
        }
    }

    fn worst_defect(&self, random: &mut Random, scratch: &mut Scratch) -> f64 {
        (0..POINTS_PER_ROOM)
            .map(|_| (self.closure(&self.receiver(random), scratch) - 1.0).abs())
            .fold(0.0, f64::max)
    }
}

/// A small solid about `center`, which stays inside the room when `size` is small enough.
fn small_solid(center: DVec3, size: f64, random: &mut Random) -> Solid {
    let shape = match random.below(3) {
        0 => Solid::tetrahedron(),
        1 => Solid::prism(3 + random.below(4)),
        _ => Solid::cube(),
    };
    let rotation = random.rotation();
    shape.map(|corner| center + rotation * (corner * size))
}

fn assert_closed(seed: u64, rooms: usize, build: impl Fn(&mut Random) -> Room) {
    let mut random = Random(seed);
    let mut scratch = Scratch::new();
    let mut worst = 0.0_f64;
    for _ in 0..rooms {
        let room = build(&mut random);
        worst = worst.max(room.worst_defect(&mut random, &mut scratch));
    }
    println!("worst closure defect over {} points: {worst:.1e}", rooms * POINTS_PER_ROOM);
    assert!(worst < TOLERANCE, "worst closure defect {worst:e}");
}

#[test]
fn an_empty_room_closes() {
    assert_closed(1, 40, Room::random);
}

#[test]
fn a_room_with_a_floating_solid_closes() {
    assert_closed(2, 60, |random| {
        let mut room = Room::random(random);
        let solid = small_solid(room.point_inside(random) * 0.5, 0.05, random);
        room.add(&solid, random);
        room
    });
}

#[test]
fn a_room_with_interpenetrating_solids_closes() {
    assert_closed(3, 60, |random| {
        let mut room = Room::random(random);
        let center = room.point_inside(random) * 0.3;
        for _ in 0..3 {
            let solid = small_solid(center + 0.05 * random.in_cube(), 0.06, random);
            room.add(&solid, random);
        }
        room
    });
}

/// Part of the wall is inside the solid, part of the solid outside the room.
#[test]
fn a_room_with_a_solid_through_its_wall_closes() {
    assert_closed(4, 50, |random| {
        let mut room = Room::random(random);
        let face = room.enclosure.faces[random.below(room.enclosure.faces.len())].clone();
        let center = point_in(&room.enclosure.outline(&face), random);
        let solid = small_solid(center, 0.2, random);
        room.add(&solid, random);
        room
    });
}

/// Boxes on the floor, on one another, side by side and edge to edge: coplanar faces, shared edges, shared corners.
#[test]
fn a_room_with_stacked_boxes_closes() {
    assert_closed(5, 50, |random| {
        let rotation = if random.below(4) == 0 { DMat3::IDENTITY } else { random.rotation() };
        let boxed = |center: DVec3, half: DVec3| Solid::cube().map(|c| rotation * (center + c * half));
        let enclosure = boxed(DVec3::ZERO, DVec3::new(1.0, 1.2, 0.9));
        let half = DVec3::new(0.2, 0.15, random.between(0.1, 0.2));
        let foot = DVec3::new(random.between(-0.4, 0.4), random.between(-0.5, 0.5), -0.9);
        let centers =
            [[0.0, 0.0, 1.0], [0.0, 0.0, 3.0], [2.0, 0.0, 1.0], [-2.0, 2.0, 1.0]].map(DVec3::from_array);
        let opaque: Vec<Solid> = centers.iter().map(|&center| boxed(foot + center * half, half)).collect();
        let mut room = Room { polygons: Vec::new(), enclosure: enclosure.clone(), opaque: opaque.clone() };
        for solid in opaque.iter().chain([&enclosure]) {
            room.add(solid, random);
        }
        room
    });
}

/// A mesh of single precision far from the origin is another mesh, but as closed as before: about its own centre, where
/// the solver puts it, nothing leaks.
#[test]
fn a_room_of_single_precision_far_away_closes() {
    for (seed, distance) in [(6, 1e4), (7, 1e5), (8, 1e6)] {
        assert_closed(seed, 20, |random| {
            let away = distance * random.direction();
            let rounded = |corner: DVec3| (corner + away).as_vec3().as_dvec3() - away;
            let rotation = random.rotation();
            // Large enough for its walls to stay planar to a thousandth at 0.06 m between two coordinates
            let enclosure = Solid::cube().map(|corner| rotation * (corner * DVec3::new(300.0, 200.0, 250.0)));
            let solid = small_solid(DVec3::new(20.0, -30.0, 10.0), 40.0, random);
            let mut polygons = Vec::new();
            for solid in [&enclosure, &solid] {
                let corners = solid.clone().map(rounded);
                let face = |face: &Vec<usize>| {
                    let outline = corners.outline(face);
                    (1..outline.len() - 1)
                        .filter_map(|i| ConvexPolygon::triangle(outline[0], outline[i], outline[i + 1]))
                        .collect::<Vec<_>>()
                };
                polygons.extend(corners.faces.iter().flat_map(face));
            }
            // Points within both the walls as they were and as they are now
            let inner = enclosure.map(|corner| corner * 0.99);
            Room { polygons, enclosure: inner, opaque: vec![solid] }
        });
    }
}

/// How far a room of 8 m with a polygon in it is from closed.
fn defect_beside(polygon: &[[f64; 3]], position: [f64; 3], normal: [f64; 3]) -> f64 {
    let polygon = ConvexPolygon::new(&polygon.iter().map(|&v| v.into()).collect::<Vec<_>>());
    let enclosure = Solid::cube().map(|corner| 4.0 * corner);
    let mut room = Room { polygons: enclosure.polygons(), enclosure, opaque: Vec::new() };
    room.polygons.extend(polygon);
    let receiver = Receiver::new(position.into(), DVec3::from(normal).normalize());
    (room.closure(&receiver, &mut Scratch::new()) - 1.0).abs()
}

/// Whatever is seen must not lie in another plane through the receiver: this once hid nothing and was seen all the same.
#[test]
fn a_point_beside_a_plane_by_less_than_what_counts_as_on_it_closes() {
    let polygon = [
        [-0.75, 1.0, 1.0],
        [0.249_999_999_999_2, -1.0, -1.0],
        [-8.000_267_115_448_878e-13, -3.0, -3.0],
        [-1.0, -1.0, -1.0],
    ];
    let defect =
        defect_beside(&polygon, [-0.500_000_000_001_07, 0.25, 0.249_999_999_998_93], [0.0, -1.0, -1.0]);
    assert!(defect < TOLERANCE, "{defect:e}");
    for height in [1e-13, 5e-13, 1e-12, 2e-12, 5e-12, 1e-11, 1e-9] {
        let square = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
        for normal in [[0.0, 1.0, 1.0], [0.0, 1.0, -1.0], [1.0, 0.0, 0.0]] {
            let defect = defect_beside(&square, [0.3, 0.3, height], normal);
            // Just above what counts as on it, the walls at its height do still.
            assert!(defect < 1e-10, "{defect:e} at {height:e} m");
        }
    }
}

/// The plane through an edge that passes a hundred-millionth of a metre beside the receiver: by its farther end, it lost
/// seven digits.
#[test]
fn an_edge_that_passes_beside_the_receiver_closes() {
    let polygon = [
        [1.0, 1.0, 0.414_062_499_863_575_8],
        [-0.75, -1.0, -0.5],
        [-2.25, -2.5, -1.914_062_499_863_575_8],
        [-0.5, -0.5, -1.0],
    ];
    let defect = defect_beside(&polygon, [-0.5, -0.499_999_99, -1.0], [-1.0, -1.0, 1.0]);
    assert!(defect < TOLERANCE, "{defect:e}");
}
