//! The visible form factor of a polygon behind others.

use antumbra::visibility::{
    ConvexPolygon, Receiver, Scratch, Visibility, unoccluded_form_factor, visible_form_factor,
};
use glam::DVec3;

use crate::bytes::Bytes;

/// Rounding of a sum over some hundred fragments.
const ROUNDING: f64 = 1e-12;

/// Of its distance, by which a point may be off a plane and count as on it.
const SNAP: f64 = 1e-12;

/// Of a room's size, by which a vertex may be off: what the solver takes coordinates to be rounded to.
const ROUNDED: f64 = 8.0 * f64::EPSILON;

/// What may be wrong with light at most, however near an edge passes the receiver: ten million executions found 1e-7, and
/// 8e-5 a ten-millionth of a metre beside slivers as narrow.
const MOST: f64 = 1e-3;

/// What may be wrong with light past these: an edge whose ends are off by `SNAP` of their distance, where it passes the
/// receiver, as an angle; and where two planes meet at a small angle, which is known to `SNAP` over that angle, or to what a
/// sliver's normal is known to.
fn snapped(receiver: &Receiver, polygons: &[&ConvexPolygon]) -> f64 {
    let corners = polygons.iter().flat_map(|polygon| polygon.vertices());
    let farthest = corners.map(|corner| corner.distance(receiver.position)).fold(0.0, f64::max);
    let nearest = (polygons.iter().map(|polygon| distance(polygon, receiver.position)))
        .filter(|distance| *distance > SNAP * farthest)
        .fold(farthest, f64::min);
    let angle = |(i, a): (usize, &&ConvexPolygon)| {
        let angles = polygons[..i].iter().map(|b| a.normal().cross(b.normal()).length());
        angles.filter(|angle| *angle > SNAP).fold(1.0, f64::min)
    };
    let least_angle = polygons.iter().enumerate().map(angle).fold(1.0, f64::min);
    let tilt = |polygon: &&ConvexPolygon| ROUNDED * 2.0 * ROOM * diameter(polygon) / polygon.area();
    let known = polygons.iter().map(tilt).fold(SNAP, f64::max);
    (known * farthest / nearest / least_angle).min(MOST)
}

fn diameter(polygon: &ConvexPolygon) -> f64 {
    let from = |a: DVec3| polygon.vertices().iter().map(move |b| a.distance(*b));
    polygon.vertices().iter().flat_map(|a| from(*a)).fold(0.0, f64::max)
}

/// From a point to the nearest of a polygon.
fn distance(polygon: &ConvexPolygon, point: DVec3) -> f64 {
    let vertices = polygon.vertices();
    let above = polygon.normal().dot(point - vertices[0]);
    let edges = || vertices.iter().zip(vertices.iter().cycle().skip(1));
    if edges().all(|(a, b)| (b - a).cross(point - a).dot(polygon.normal()) >= 0.0) {
        return above.abs();
    }
    let to_edge = |(a, b): (&DVec3, &DVec3)| {
        let along = ((point - a).dot(b - a) / a.distance_squared(*b)).clamp(0.0, 1.0);
        point.distance(a.lerp(*b, along))
    };
    edges().map(to_edge).fold(f64::INFINITY, f64::min)
}

/// Between 0 and what is there without blockers, never more with one more of them, and the same in any order.
pub fn form_factor(bytes: &[u8]) {
    let mut bytes = Bytes::new(bytes);
    let Some(source) = bytes.polygon() else { return };
    let receiver = Receiver::new(bytes.point(), bytes.direction());
    let count = bytes.up_to(12);
    let blockers: Vec<ConvexPolygon> = (0..count).filter_map(|_| bytes.polygon()).collect();
    let mut candidates: Vec<u32> = (0..blockers.len() as u32).collect();
    let mut scratch = Scratch::new();

    let unoccluded = unoccluded_form_factor(&receiver, &source);
    assert!((0.0..=1.0 + ROUNDING).contains(&unoccluded), "{unoccluded}");
    let Ok(seen) = visible_form_factor(&receiver, &source, &blockers, &candidates, &mut scratch) else {
        return;
    };
    assert!((0.0..=unoccluded).contains(&seen.value), "{seen:?}");
    match seen.state {
        Visibility::BelowHorizon => assert_eq!(unoccluded, 0.0),
        Visibility::Visible => assert_eq!(seen.value, unoccluded),
        Visibility::Hidden => assert_eq!(seen.value, 0.0),
        Visibility::Partial => {}
    }

    candidates.reverse();
    let again = visible_form_factor(&receiver, &source, &blockers, &candidates, &mut scratch);
    assert_eq!(again.expect("it was simple before"), seen);
    if candidates.pop().is_some() {
        let fewer = visible_form_factor(&receiver, &source, &blockers, &candidates, &mut scratch);
        let all: Vec<&ConvexPolygon> = blockers.iter().chain([&source]).collect();
        let rounding = ROUNDING + snapped(&receiver, &all);
        assert!(
            fewer.is_err() || fewer.is_ok_and(|fewer| seen.value <= fewer.value + rounding),
            "{seen:?} of {fewer:?}"
        );
    }
}

/// Half the side of the room; polygons reach to 3.
const ROOM: f64 = 4.0;

/// In a closed room, whatever stands in it, everything together fills the hemisphere: nothing leaks, nothing is lost.
pub fn closure(bytes: &[u8]) {
    let mut bytes = Bytes::new(bytes);
    let receiver = Receiver::new(bytes.point(), bytes.direction());
    let count = bytes.up_to(6);
    let mut polygons: Vec<ConvexPolygon> = (0..count).filter_map(|_| bytes.polygon()).collect();
    let overlap = may_overlap(&polygons);
    polygons.extend(walls());
    let candidates: Vec<u32> = (0..polygons.len() as u32).collect();
    let mut scratch = Scratch::new();
    let mut sum = 0.0;
    for source in &polygons {
        let seen = visible_form_factor(&receiver, source, &polygons, &candidates, &mut scratch);
        let Ok(seen) = seen else { return };
        sum += seen.value;
    }
    let rounding = ROUNDING + snapped(&receiver, &polygons.iter().collect::<Vec<_>>());
    assert!(sum >= 1.0 - rounding, "{:e} of the light is lost, beyond {rounding:e}", 1.0 - sum);
    // What lies in one plane hides none of it, and counts twice where it overlaps.
    assert!(overlap || sum <= 1.0 + rounding, "{:e} too much, beyond {rounding:e}", sum - 1.0);
}

fn walls() -> impl Iterator<Item = ConvexPolygon> {
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    (0..3).flat_map(move |axis| {
        let (u, v) = (axes[(axis + 1) % 3] * ROOM, axes[(axis + 2) % 3] * ROOM);
        [-ROOM, ROOM].map(|at| {
            let middle = axes[axis] * at;
            ConvexPolygon::new(&[middle - u - v, middle + u - v, middle + u + v, middle - u + v])
                .expect("a wall")
        })
    })
}

/// Whether two of them lie in one plane, or so nearly that it is for rounding to say.
fn may_overlap(polygons: &[ConvexPolygon]) -> bool {
    polygons.iter().enumerate().any(|(i, a)| {
        polygons[..i].iter().any(|b| {
            let off = |v: &DVec3| a.normal().dot(*v - a.centroid()).abs() < 1e-6;
            b.vertices().iter().all(off)
        })
    })
}
