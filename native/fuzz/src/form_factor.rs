//! The visible form factor of a polygon behind others.

use antumbra::visibility::{
    ConvexPolygon, Receiver, Scratch, Visibility, unoccluded_form_factor, visible_form_factor,
};
use glam::DVec3;

use crate::bytes::Bytes;

/// Rounding of a sum over some hundred fragments.
const ROUNDING: f64 = 1e-12;

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
        assert!(
            fewer.is_err() || fewer.is_ok_and(|fewer| seen.value <= fewer.value + ROUNDING),
            "{seen:?} of {fewer:?}"
        );
    }
}

/// Metres in a room of 8 m, where points within 1e-12 of their distance lie on a plane.
const NEARLY: f64 = 1e-10;

/// Half the side of the room; polygons reach to 3.
const ROOM: f64 = 4.0;

/// In a closed room, whatever stands in it, everything together fills the hemisphere: nothing leaks, nothing is lost.
pub fn closure(bytes: &[u8]) {
    let mut bytes = Bytes::new(bytes);
    let receiver = Receiver::new(bytes.point(), bytes.direction());
    let count = bytes.up_to(6);
    let mut polygons: Vec<ConvexPolygon> = (0..count).filter_map(|_| bytes.polygon()).collect();
    let overlap = may_overlap(&polygons);
    if polygons.iter().any(|polygon| nearly_touches(polygon, &receiver)) {
        return;
    }
    polygons.extend(walls());
    let candidates: Vec<u32> = (0..polygons.len() as u32).collect();
    let mut scratch = Scratch::new();
    let mut sum = 0.0;
    for source in &polygons {
        let seen = visible_form_factor(&receiver, source, &polygons, &candidates, &mut scratch);
        let Ok(seen) = seen else { return };
        sum += seen.value;
    }
    assert!(sum >= 1.0 - 1e-9, "{:e} of the light is lost", 1.0 - sum);
    // What lies in one plane hides none of it, and counts twice where it overlaps.
    assert!(overlap || sum <= 1.0 + 1e-9, "{:e} too much", sum - 1.0);
}

/// Whether a receiver is off a polygon's plane by less than is told from lying on it: what is so near may be seen and yet
/// hide nothing.
fn nearly_touches(polygon: &ConvexPolygon, receiver: &Receiver) -> bool {
    let distance = polygon.normal().dot(polygon.centroid() - receiver.position).abs();
    distance > 0.0 && distance < NEARLY
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
