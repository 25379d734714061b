//! Time of one exact visible form factor against the number of blockers, on one core.

use std::hint::black_box;

use antumbra::visibility::{ConvexPolygon, Receiver, Scratch, unoccluded_form_factor, visible_form_factor};
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use glam::DVec3;

/// Additive recurrence with the plastic number (Roberts 2018): evenly spread points in 0..1.
fn spread(i: usize, dimension: i32) -> f64 {
    (0.5 + (i + 1) as f64 * 1.324_717_957_244_746_f64.powi(-dimension - 1)).fract()
}

/// Triangles of about `size` that float between the receivers at z = 0 and the light at z = 2, in a column of the
/// light's width times `width`.
fn floating_triangles(count: usize, size: f64, width: f64) -> Vec<ConvexPolygon> {
    (0..count)
        .map(|i| {
            let center = DVec3::new(
                width * (spread(i, 0) - 0.5),
                width * (spread(i, 1) - 0.5),
                0.4 + 1.4 * spread(i, 2),
            );
            let corner = |k: usize| {
                let offset = [spread(3 * i + k, 2), spread(3 * i + k, 1), spread(3 * i + k, 0)];
                let turn = f64::from(u8::try_from(k).expect("0, 1 or 2")) * std::f64::consts::TAU / 3.0;
                center
                    + size
                        * (DVec3::new(turn.cos(), turn.sin(), 0.0)
                            + 0.5 * (DVec3::from(offset) - DVec3::splat(0.5)))
            };
            ConvexPolygon::triangle(corner(0), corner(1), corner(2)).expect("it has area")
        })
        .collect()
}

/// A ball of triangles between the receivers and the light.
fn ball(rings: usize, sectors: usize) -> Vec<ConvexPolygon> {
    let corner = |ring: usize, sector: usize| {
        let polar = std::f64::consts::PI * ring as f64 / rings as f64;
        let turn = std::f64::consts::TAU * (sector % sectors) as f64 / sectors as f64;
        DVec3::new(0.05, 0.1, 1.0)
            + 0.2 * DVec3::new(polar.sin() * turn.cos(), polar.sin() * turn.sin(), polar.cos())
    };
    let mut triangles = Vec::new();
    for ring in 0..rings {
        for sector in 0..sectors {
            let (a, b) = (corner(ring, sector), corner(ring, sector + 1));
            let (c, d) = (corner(ring + 1, sector), corner(ring + 1, sector + 1));
            if ring > 0 {
                triangles.extend(ConvexPolygon::triangle(a, c, b));
            }
            if ring + 1 < rings {
                triangles.extend(ConvexPolygon::triangle(b, c, d));
            }
        }
    }
    triangles
}

fn light() -> ConvexPolygon {
    let corners = [[-0.5, -0.5], [-0.5, 0.5], [0.5, 0.5], [0.5, -0.5]];
    ConvexPolygon::new(&corners.map(|[x, y]| DVec3::new(x, y, 2.0))).expect("it has area")
}

/// Receivers on the floor, under the light and beside it.
fn receivers() -> Vec<Receiver> {
    (0..64)
        .map(|i| DVec3::new(2.0 * spread(i, 0) - 1.0, 2.0 * spread(i, 1) - 1.0, 0.0))
        .map(|position| Receiver::new(position, DVec3::Z))
        .collect()
}

fn benchmark(criterion: &mut Criterion) {
    let (light, receivers) = (light(), receivers());
    let mut next = receivers.iter().cycle();
    criterion.bench_function("unoccluded", |bencher| {
        bencher.iter(|| unoccluded_form_factor(black_box(next.next().expect("a cycle")), black_box(&light)));
    });

    let mut group = criterion.benchmark_group("visible");
    let mut scenes: Vec<(&str, Vec<ConvexPolygon>)> = Vec::new();
    for count in [0, 1, 2, 4, 8, 16, 32, 64] {
        scenes.push(("floating triangles", floating_triangles(count, 0.1, 1.0)));
    }
    for count in [16, 32] {
        scenes.push(("larger triangles", floating_triangles(count, 0.3, 1.0)));
    }
    scenes.push(("triangles beside the light", floating_triangles(32, 0.1, 12.0)));
    scenes.push(("ball", ball(6, 8)));
    scenes.push(("ball", ball(12, 16)));
    for (name, blockers) in &scenes {
        let candidates: Vec<u32> = (0..blockers.len() as u32).collect();
        let mut scratch = Scratch::new();
        group.bench_function(BenchmarkId::new(*name, blockers.len()), |bencher| {
            bencher.iter(|| {
                let receiver = black_box(next.next().expect("a cycle"));
                visible_form_factor(receiver, black_box(&light), blockers, &candidates, &mut scratch)
            });
        });
    }
    group.finish();
}

criterion_group!(benches, benchmark);
criterion_main!(benches);
