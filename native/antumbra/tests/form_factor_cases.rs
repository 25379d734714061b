//! Stiff and extreme cases of the exact visible form factor, and what holds for every scene.

mod common;

use antumbra::visibility::{
    ConvexPolygon, MAX_FRAGMENTS, Receiver, Scratch, TooManyFragments, Visibility, VisibleFormFactor,
    unoccluded_form_factor, visible_form_factor,
};
use common::{Random, Solid, polygon, receiver, rectangle, visible};
use glam::DVec3;
use proptest::prelude::*;

/// A unit square at z = 2 that faces down.
fn light() -> ConvexPolygon {
    rectangle(DVec3::new(-0.5, -0.5, 2.0), DVec3::Y, DVec3::X)
}

/// A point on the floor, off the light's axis.
fn floor_point() -> Receiver {
    receiver([0.3, -0.2, 0.0], [0.0, 0.0, 1.0])
}

/// A horizontal rectangle about `center`.
fn shade(center: [f64; 3], width: f64, depth: f64) -> ConvexPolygon {
    let corner = DVec3::from(center) - DVec3::new(0.5 * width, 0.5 * depth, 0.0);
    rectangle(corner, DVec3::X * width, DVec3::Y * depth)
}

/// `blockers` change nothing, to the last bit.
fn assert_no_effect(receiver: &Receiver, source: &ConvexPolygon, blockers: &[ConvexPolygon]) {
    let seen = visible(receiver, source, blockers);
    let unoccluded = unoccluded_form_factor(receiver, source);
    assert!(unoccluded > 0.0);
    assert_eq!(seen, VisibleFormFactor { value: unoccluded, unoccluded, state: Visibility::Visible });
}

fn assert_same(left: f64, right: f64, tolerance: f64) {
    assert!((left - right).abs() <= tolerance, "{left} and {right} differ by {:e}", left - right);
}

/// A receiver, a source and blockers between them, about one unit in size.
fn random_scene(random: &mut Random, blockers: usize) -> (Receiver, ConvexPolygon, Vec<ConvexPolygon>) {
    let mut triangle = |center: DVec3, size: f64| {
        loop {
            let mut corner = || center + size * random.in_cube();
            if let Some(triangle) = ConvexPolygon::triangle(corner(), corner(), corner()) {
                return triangle;
            }
        }
    };
    let source = triangle(DVec3::new(0.0, 0.0, 2.0), 1.0);
    let blockers = (0..blockers).map(|_| triangle(DVec3::new(0.0, 0.0, 1.0), 0.7)).collect();
    let normal = (DVec3::Z + random.in_cube()).normalize();
    (Receiver::new(0.5 * random.in_cube(), normal), source, blockers)
}

fn moved(polygon: &ConvexPolygon, place: impl Fn(DVec3) -> DVec3) -> ConvexPolygon {
    common::polygon(&polygon.vertices().iter().map(|&vertex| place(vertex)).collect::<Vec<_>>())
}

/// The worst difference that `place` makes to 1,000 random scenes.
fn worst_difference(place: impl Fn(DVec3) -> DVec3 + Copy) -> f64 {
    let mut random = Random(7);
    let mut worst = 0.0_f64;
    for i in 0..1000 {
        let (receiver, source, blockers) = random_scene(&mut random, i % 8);
        let there = Receiver::new(place(receiver.position), receiver.normal);
        let blockers_there: Vec<_> = blockers.iter().map(|blocker| moved(blocker, place)).collect();
        let here = visible(&receiver, &source, &blockers).value;
        worst = worst.max((visible(&there, &moved(&source, place), &blockers_there).value - here).abs());
    }
    worst
}

#[test]
fn scaled_by_1e_minus_6_and_by_1e6() {
    for scale in [1e-6, 1e6] {
        let worst = worst_difference(|p| p * scale);
        assert!(worst < 1e-12, "scaled by {scale:e}: {worst:e}");
    }
}

#[test]
fn moved_1e6_away() {
    let worst = worst_difference(|p| p + DVec3::new(1e6, -1e6, 1e6));
    assert!(worst < 1e-9, "{worst:e}");
}

#[test]
fn a_sliver_blocker_hides_no_more_than_its_solid_angle() {
    let point = floor_point();
    let sliver = shade([0.2, -0.1, 1.0], 0.5, 1e-9);
    let seen = visible(&point, &light(), std::slice::from_ref(&sliver));
    let hidden = seen.unoccluded - seen.value;
    assert!(hidden > 0.0);
    assert!(hidden <= unoccluded_form_factor(&point, &sliver) + 1e-16);
}

/// Turned, so that they are coplanar but for rounding, near the origin and far from it.
#[test]
fn coplanar_overlapping_polygons_neither_light_nor_shadow_each_other() {
    let mut random = Random(11);
    for i in 0..400 {
        let (rotation, offset) = (random.rotation(), [0.0, 1e6][i % 2] * random.direction());
        let place = |p: DVec3| rotation * p + offset;
        let source = moved(&light(), place);
        let overlapping = moved(&shade([0.2, 0.3, 2.0], 0.7, 0.3), place);
        let point = place(DVec3::Z + 0.4 * random.in_cube());
        let below = Receiver::new(point, rotation * DVec3::Z);
        assert_no_effect(&below, &source, std::slice::from_ref(&overlapping));
        assert_no_effect(&below, &overlapping, std::slice::from_ref(&source));
        let on_it = Receiver::new(overlapping.centroid(), overlapping.normal());
        for normal in [on_it.normal, -on_it.normal] {
            assert_eq!(visible(&Receiver::new(on_it.position, normal), &source, &[]).value, 0.0);
            let lamp = moved(&shade([0.0, 0.0, 2.0], 1.0, 1.0), |p| place(p) + 0.5 * normal);
            assert_no_effect(
                &Receiver::new(on_it.position, normal),
                &lamp,
                &[source.clone(), overlapping.clone()],
            );
        }
    }
}

#[test]
fn duplicate_blockers_block_once() {
    let blocker = shade([0.2, 0.0, 1.0], 0.2, 0.1);
    let once = visible(&floor_point(), &light(), std::slice::from_ref(&blocker));
    assert_eq!(once.state, Visibility::Partial);
    assert_eq!(visible(&floor_point(), &light(), &[blocker.clone(), blocker.clone(), blocker]), once);
}

/// A fan of triangles about a point, together larger than the light: not 1e-15 of the light leaks between them.
#[test]
fn blockers_that_touch_along_edges_leak_nothing() {
    let mut random = Random(13);
    let mut scratch = Scratch::new();
    for i in 0..500 {
        let rotation = random.rotation();
        let sides = 3 + i % 9;
        let hub = DVec3::new(random.between(0.0, 0.3), random.between(-0.2, 0.1), random.between(0.8, 1.2));
        let rim: Vec<DVec3> = (0..sides)
            .map(|k| std::f64::consts::TAU * k as f64 / sides as f64)
            .map(|angle| DVec3::new(2.0 * angle.cos(), 2.0 * angle.sin(), random.between(0.8, 1.2)))
            .collect();
        let corner = |k: usize| rotation * rim[k % sides];
        let fan: Vec<_> = (0..sides).map(|k| polygon(&[rotation * hub, corner(k), corner(k + 1)])).collect();
        let source = moved(&light(), |p| rotation * p);
        let point = Receiver::new(rotation * floor_point().position, rotation * DVec3::Z);
        let candidates: Vec<u32> = (0..sides as u32).collect();
        let seen = visible_form_factor(&point, &source, &fan, &candidates, &mut scratch).expect("simple");
        assert_eq!((seen.value, seen.state), (0.0, Visibility::Hidden), "fan {i}");
        // Without one of the light blockers some light comes through.
        let without: Vec<u32> = candidates.into_iter().filter(|id| *id != scratch.blockers()[0]).collect();
        let seen = visible_form_factor(&point, &source, &fan, &without, &mut scratch).expect("simple");
        assert!(seen.value > 0.0, "fan {i}");
    }
}

/// Two rectangles that pierce each other in the same pyramid of sight hide what either does.
#[test]
fn blockers_that_intersect_block_their_union() {
    let point = Receiver::new(DVec3::ZERO, DVec3::Z);
    let across = |left: f64, right: f64| {
        let corner = |x: f64, y: f64, z: f64| DVec3::new(x * z, y * z, z);
        polygon(&[
            corner(-0.1, -0.1, left),
            corner(0.15, -0.1, right),
            corner(0.15, 0.1, right),
            corner(-0.1, 0.1, left),
        ])
    };
    let (rising, falling) = (across(0.8, 1.2), across(1.3, 0.7));
    let alone = visible(&point, &light(), std::slice::from_ref(&rising)).value;
    assert!(alone > 0.0 && alone < unoccluded_form_factor(&point, &light()));
    assert_same(visible(&point, &light(), &[rising, falling]).value, alone, 1e-15);

    // Two that overlap crosswise hide what both do, less what both would hide twice.
    let (wide, deep) = (shade([0.0, 0.0, 1.0], 0.4, 0.1), shade([0.0, 0.0, 1.1], 0.11, 0.44));
    let both = shade([0.0, 0.0, 1.0], 0.1, 0.1);
    let hidden = |blockers: &[ConvexPolygon]| {
        let seen = visible(&point, &light(), blockers);
        seen.unoccluded - seen.value
    };
    let sum = hidden(std::slice::from_ref(&wide)) + hidden(std::slice::from_ref(&deep)) - hidden(&[both]);
    assert_same(hidden(&[wide, deep]), sum, 1e-15);
}

#[test]
fn a_blocker_in_the_lights_plane_or_behind_it_has_no_effect() {
    assert_no_effect(&floor_point(), &light(), &[shade([0.0, 0.0, 2.0], 3.0, 3.0)]);
    assert_no_effect(&floor_point(), &light(), &[shade([0.0, 0.0, 2.0 + 1e-9], 3.0, 3.0)]);
    assert_no_effect(&floor_point(), &light(), &[light()]);
    assert_no_effect(&floor_point(), &light(), &[rectangle(DVec3::Z * 2.0, DVec3::X, DVec3::Z)]);
}

#[test]
fn a_blocker_that_holds_the_receiver_in_its_plane_has_no_effect() {
    let point = floor_point();
    assert_no_effect(&point, &light(), &[shade([0.0, 0.0, 0.0], 3.0, 3.0)]);
    assert_no_effect(&point, &light(), &[rectangle(DVec3::new(0.3, -1.0, 0.0), DVec3::Y * 2.0, DVec3::Z)]);
    // Also when rounding puts it beside the plane: 0.1 + 0.2 is not 0.3.
    let beside = Receiver::new(DVec3::new(0.1 + 0.2, -0.2, 0.0), point.normal);
    assert_no_effect(&beside, &light(), &[rectangle(DVec3::new(0.3, -1.0, 0.0), DVec3::Y * 2.0, DVec3::Z)]);
}

#[test]
fn a_blocker_that_pierces_the_light_hides_only_what_is_behind_it() {
    let tilted = |from: f64, to: f64| {
        let corner = |y: f64, z: f64| DVec3::new(-0.2 + 0.3 * (z - 1.5), y, z);
        polygon(&[corner(-0.3, from), corner(0.3, from), corner(0.3, to), corner(-0.3, to)])
    };
    let piercing = visible(&floor_point(), &light(), &[tilted(1.5, 2.5)]);
    let up_to_the_light = visible(&floor_point(), &light(), &[tilted(1.5, 2.0)]);
    assert_eq!(piercing.state, Visibility::Partial);
    assert_same(piercing.value, up_to_the_light.value, 1e-15);
}

#[test]
fn a_blocker_across_the_horizon_is_as_if_clipped() {
    let source = rectangle(DVec3::new(2.0, -0.5, -1.0), DVec3::Y, DVec3::Z * 2.0);
    let screen = |bottom: f64| rectangle(DVec3::new(1.0, 0.0, bottom), DVec3::Y, DVec3::Z * (0.3 - bottom));
    let point = Receiver::new(DVec3::ZERO, DVec3::Z);
    let across = visible(&point, &source, &[screen(-5.0)]);
    assert_eq!(across.state, Visibility::Partial);
    assert_same(across.value, visible(&point, &source, &[screen(0.0)]).value, 1e-16);
    assert_no_effect(
        &point,
        &source,
        &[rectangle(DVec3::new(1.0, -1.0, -2.0), DVec3::Y * 2.0, DVec3::Z * 2.0)],
    );
}

#[test]
fn a_light_edge_on_or_below_the_horizon_is_not_seen() {
    let nothing = VisibleFormFactor { value: 0.0, unoccluded: 0.0, state: Visibility::BelowHorizon };
    for position in [[1.5, 0.0, 2.0], [0.1, 0.2, 2.0], [0.5, 0.0, 2.0], [0.5, 0.5, 2.0]] {
        // Beside it, inside it, on its edge, on its corner
        for normal in [DVec3::Z, -DVec3::Z, -DVec3::X] {
            let point = Receiver::new(position.into(), normal);
            assert_eq!(visible(&point, &light(), &[]), nothing, "{point:?}");
            assert_eq!(unoccluded_form_factor(&point, &light()), 0.0, "{point:?}");
        }
    }
    assert_eq!(visible(&receiver([0.0; 3], [0.0, 0.0, -1.0]), &light(), &[]), nothing);
    let coplanar = receiver([0.0, 0.0, 2.0], [0.0, 0.0, 1.0]);
    assert_eq!(visible(&coplanar, &shade([3.0, 0.0, 2.0], 1.0, 1.0), &[]), nothing);
}

/// At the common edge with a perpendicular wall, half of the hemisphere: the limit from inside the receiver.
#[test]
fn a_light_that_touches_at_a_right_angle_fills_half_at_the_edge() {
    let wall = rectangle(DVec3::new(0.0, -1.0, 0.0), DVec3::Y * 2.0, DVec3::Z);
    for distance in [1e-3, 1e-6, 1e-9] {
        let form_factor = unoccluded_form_factor(&receiver([distance, 0.0, 0.0], [0.0, 0.0, 1.0]), &wall);
        assert_same(form_factor, 0.5, distance);
    }
}

#[test]
fn a_light_of_size_1e_minus_6_is_a_point_light() {
    for size in [1e-4, 1e-6, 1e-9] {
        // Powers of two keep the corners exact, so that the area is that of the polygon.
        let size = 2.0_f64.powf(f64::log2(size).round());
        let small = rectangle(DVec3::new(-0.5 * size, -0.5 * size, 1.0), DVec3::X * size, DVec3::Y * size);
        let point = receiver([0.5, 0.25, 0.0], [0.25, 0.0, 1.0]);
        let distance2 = 1.0 + 0.25 + 0.0625;
        let cosines = point.normal.dot(DVec3::new(-0.5, -0.25, 1.0)) / distance2;
        let limit = small.area() * cosines / (std::f64::consts::PI * distance2);
        let form_factor = unoccluded_form_factor(&point, &small);
        assert_same(form_factor / limit, 1.0, 1e-12 + 3.0 * size * size);
    }
}

/// The quadrature and the contour are the same function where they meet.
#[test]
fn form_factor_is_continuous_where_the_method_changes() {
    let point = receiver([0.0; 3], [0.3, 0.2, 1.0]);
    for i in 0..200 {
        let size = 0.006 + 1e-5 * f64::from(i);
        let square = |size: f64| shade([0.4, 0.1, 1.0], size, size);
        // The parts are below the size where the method changes, long before the whole is.
        let parts: f64 = [(-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25)]
            .map(|(x, y)| shade([0.4 + x * size, 0.1 + y * size, 1.0], 0.5 * size, 0.5 * size))
            .iter()
            .map(|part| unoccluded_form_factor(&point, part))
            .sum();
        let whole = unoccluded_form_factor(&point, &square(size));
        assert_same(parts / whole, 1.0, 1e-12);
    }
}

#[test]
fn a_light_1e6_wide_fills_the_hemisphere() {
    for (width, height) in [(1e6, 1.0), (1e12, 1e3), (1e6, 1e-3)] {
        let sky = shade([0.0, 0.0, height], width, width);
        let point = receiver([0.0; 3], [0.0, 0.0, 1.0]);
        let form_factor = unoccluded_form_factor(&point, &sky);
        // What is missing is the cosine-weighted ring below the sky's edge.
        assert!(form_factor <= 1.0);
        assert_same(form_factor, 1.0, 1e-15 + 5.0 * (height / width).powi(2));
        let seen = visible(&point, &sky, &[shade([0.0, 0.0, 0.5 * height], height, height)]);
        let hidden = unoccluded_form_factor(&point, &shade([0.0, 0.0, 0.5], 1.0, 1.0));
        // A cut through the light is rounded to an epsilon of the light's width.
        assert_same(seen.value, form_factor - hidden, f64::EPSILON * width / height);
    }
}

#[test]
fn a_light_shut_in_a_box_is_exactly_dark_outside() {
    let mut random = Random(17);
    let shapes = [Solid::cube(), Solid::tetrahedron(), Solid::prism(3), Solid::prism(7)];
    for i in 0..2000 {
        let rotation = random.rotation();
        let solid = shapes[i % 4].clone().map(|corner| rotation * corner);
        let walls = if i % 3 == 0 { solid.polygons() } else { solid.triangles(&mut random) };
        let mut corner = || 0.25 * random.direction();
        let Some(source) = ConvexPolygon::triangle(corner(), corner(), corner()) else { continue };
        let position = random.between(2.0, 6.0) * random.direction();
        let point = Receiver::new(position, (-position.normalize() + 0.8 * random.in_cube()).normalize());
        let seen = visible(&point, &source, &walls);
        assert_eq!(seen.value, 0.0, "{seen:?} from {point:?}");
    }
}

/// A corner of a parallelogram a millionth wide, whose rounded corners do not lie in one plane: the receiver in one of them
/// is in the plane of its edges and not in that of its face. What it sees is a number all the same.
#[test]
fn a_receiver_in_the_corner_of_a_sliver_sees_a_number() {
    let sliver = polygon(&[
        DVec3::new(0.25, 0.250_000_94, 9.4e-7),
        DVec3::new(-0.999_999_06, -1.0, -1.0),
        DVec3::new(-2.249_999_06, -2.250_000_94, -2.000_000_94),
        DVec3::new(-1.0, -1.0, -1.0),
    ]);
    let point = Receiver::new(DVec3::splat(-1.0), DVec3::splat(-1.0).normalize());
    assert!((0.0..=1.0).contains(&unoccluded_form_factor(&point, &sliver)));
}

/// The same in the corner of another: in the plane of a face as well as that is known, whose rounded corners turn it, a
/// receiver sees nothing of it. It once filled a twentieth of the hemisphere, the more the more stood before it.
#[test]
fn a_receiver_in_the_corner_of_a_sliver_is_in_its_plane() {
    let sliver = polygon(&[
        DVec3::new(-1.0, 0.0, -1.8e-7),
        DVec3::new(-0.750_000_000_000_12, -0.749_999_54, -0.749_999_54),
        DVec3::new(-0.499_999_540_000_120_04, -1.499_999_08, -1.499_998_9),
        DVec3::splat(-0.749_999_54),
    ]);
    let normal = DVec3::new(-0.514_495_5, -0.514_495_9, -0.685_994_4).normalize();
    let point = Receiver::new(DVec3::splat(-0.749_999_54), normal);
    assert_eq!(unoccluded_form_factor(&point, &sliver), 0.0);
    // Of a sliver that stands before it it sees what there is.
    let before = moved(&sliver, |vertex| vertex - 0.1 * DVec3::Z);
    assert!(unoccluded_form_factor(&point, &before) > 0.0);
}

/// A lattice of more holes than the guard allows is refused, and says what it can.
#[test]
fn too_many_fragments_are_refused() {
    let side = 40;
    assert!(side * side > MAX_FRAGMENTS);
    let tiles: Vec<_> = (0..side * side)
        .map(|i| [(i % side) as f64, (i / side) as f64].map(|k| (k + 0.5) / side as f64 - 0.5))
        .map(|[x, y]| shade([0.5 * x, 0.5 * y, 1.0], 0.2 / side as f64, 0.2 / side as f64))
        .collect();
    let candidates: Vec<u32> = (0..tiles.len() as u32).collect();
    let point = Receiver::new(DVec3::ZERO, DVec3::Z);
    let mut scratch = Scratch::new();
    let refused = visible_form_factor(&point, &light(), &tiles, &candidates, &mut scratch);
    let unoccluded = unoccluded_form_factor(&point, &light());
    assert_eq!(refused, Err(TooManyFragments { unoccluded }));
    // The buffers serve the next call as if nothing had been.
    let seen = visible_form_factor(&point, &light(), &tiles, &candidates[..1], &mut scratch);
    assert_eq!(seen, Ok(visible(&point, &light(), &tiles[..1])));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn visible_is_between_0_and_unoccluded(seed: u64, count in 0_usize..12) {
        let (receiver, source, blockers) = random_scene(&mut Random(seed), count);
        let seen = visible(&receiver, &source, &blockers);
        prop_assert!(0.0 <= seen.value && seen.value <= seen.unoccluded && seen.unoccluded <= 1.0);
        prop_assert_eq!(seen.unoccluded, unoccluded_form_factor(&receiver, &source));
        match seen.state {
            Visibility::BelowHorizon => prop_assert_eq!(seen.unoccluded, 0.0),
            Visibility::Visible => prop_assert_eq!(seen.value, seen.unoccluded),
            Visibility::Hidden => prop_assert_eq!(seen.value, 0.0),
            Visibility::Partial => {}
        }
    }

    #[test]
    fn another_blocker_never_adds_light(seed: u64, count in 1_usize..12) {
        let (receiver, source, blockers) = random_scene(&mut Random(seed), count);
        let fewer = visible(&receiver, &source, &blockers[1..]).value;
        prop_assert!(visible(&receiver, &source, &blockers).value <= fewer + 1e-15);
    }

    #[test]
    fn the_order_of_blockers_changes_nothing(seed: u64, count in 2_usize..12) {
        let mut random = Random(seed);
        let (receiver, source, mut blockers) = random_scene(&mut random, count);
        let seen = visible(&receiver, &source, &blockers);
        let mut candidates: Vec<u32> = (0..count as u32).collect();
        random.shuffle(&mut candidates);
        let again = visible_form_factor(&receiver, &source, &blockers, &candidates, &mut Scratch::new());
        prop_assert_eq!(again, Ok(seen));
        random.shuffle(&mut blockers);
        prop_assert!((visible(&receiver, &source, &blockers).value - seen.value).abs() <= 1e-15);
    }

    #[test]
    fn only_light_blockers_matter(seed: u64, count in 0_usize..12) {
        let (receiver, source, blockers) = random_scene(&mut Random(seed), count);
        let candidates: Vec<u32> = (0..count as u32).collect();
        let mut scratch = Scratch::new();
        let seen = visible_form_factor(&receiver, &source, &blockers, &candidates, &mut scratch);
        let light_blockers = scratch.blockers().to_vec();
        let again = visible_form_factor(&receiver, &source, &blockers, &light_blockers, &mut scratch);
        prop_assert_eq!(seen, again);
        prop_assert_eq!(scratch.blockers(), light_blockers);
    }

    /// The source's winding and its first vertex are of no account.
    #[test]
    fn the_sources_winding_changes_nothing(seed: u64, count in 0_usize..6) {
        let (receiver, source, blockers) = random_scene(&mut Random(seed), count);
        let seen = visible(&receiver, &source, &blockers).value;
        let [a, b, c] = [0, 1, 2].map(|i| source.vertices()[i]);
        for outline in [[c, b, a], [b, c, a]] {
            let other = visible(&receiver, &polygon(&outline), &blockers).value;
            prop_assert!((other - seen).abs() <= 1e-15);
        }
    }
}
