//! Solids, random numbers and quadrature for the tests of the exact visible form factor; scenes for the solver's.
#![allow(dead_code, reason = "each test file uses its part of this")]

pub(crate) mod baked;
pub(crate) mod lines;
pub(crate) mod planned;
pub(crate) mod scene;
pub(crate) mod shape;
pub(crate) mod verified;

use antumbra::visibility::{ConvexPolygon, Receiver, Scratch, VisibleFormFactor, visible_form_factor};
use glam::{DMat3, DQuat, DVec3, EulerRot};

/// `SplitMix64` (Steele, Lea, Flood 2014): the same numbers on every machine.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in 0..1, never either.
    pub(crate) fn unit(&mut self) -> f64 {
        ((self.next() >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub(crate) fn below(&mut self, count: usize) -> usize {
        (self.next() % count as u64) as usize
    }

    pub(crate) fn in_cube(&mut self) -> DVec3 {
        DVec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0))
    }

    pub(crate) fn direction(&mut self) -> DVec3 {
        loop {
            let v = self.in_cube();
            if (0.01..=1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }

    pub(crate) fn rotation(&mut self) -> DMat3 {
        let mut angle = || self.between(0.0, std::f64::consts::TAU);
        DMat3::from_quat(DQuat::from_euler(EulerRot::ZXZ, angle(), angle(), angle()))
    }

    pub(crate) fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            items.swap(i, self.below(i + 1));
        }
    }
}

/// A closed convex solid: corners, and faces counter-clockwise seen from outside.
#[derive(Clone)]
pub(crate) struct Solid {
    pub(crate) corners: Vec<DVec3>,
    pub(crate) faces: Vec<Vec<usize>>,
}

impl Solid {
    /// -1..1 along each axis.
    pub(crate) fn cube() -> Self {
        let corner =
            |i: usize| DVec3::new([-1.0, 1.0][i & 1], [-1.0, 1.0][i >> 1 & 1], [-1.0, 1.0][i >> 2 & 1]);
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
            .map(Vec::from);
        Self { corners: (0..8).map(corner).collect(), faces: faces.to_vec() }
    }

    pub(crate) fn tetrahedron() -> Self {
        let corners = [[1.0, 1.0, 1.0], [-1.0, -1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0]];
        let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]].map(Vec::from);
        Self { corners: corners.map(DVec3::from).to_vec(), faces: faces.to_vec() }
    }

    /// A regular prism of `sides` sides about the z axis, radius 1, z from -1 to 1.
    pub(crate) fn prism(sides: usize) -> Self {
        let corner = |i: usize, z: f64| {
            let angle = std::f64::consts::TAU * i as f64 / sides as f64;
            DVec3::new(angle.cos(), angle.sin(), z)
        };
        let corners = (0..2 * sides).map(|i| corner(i % sides, if i < sides { -1.0 } else { 1.0 })).collect();
        let mut faces: Vec<Vec<usize>> =
            (0..sides).map(|i| (i, (i + 1) % sides)).map(|(i, j)| vec![i, j, sides + j, sides + i]).collect();
        faces.push((0..sides).rev().collect());
        faces.push((sides..2 * sides).collect());
        Self { corners, faces }
    }

    pub(crate) fn map(mut self, place: impl Fn(DVec3) -> DVec3) -> Self {
        for corner in &mut self.corners {
            *corner = place(*corner);
        }
        self
    }

    /// Whether the point is behind every face.
    pub(crate) fn contains(&self, point: DVec3) -> bool {
        self.polygons().iter().all(|face| face.normal().dot(point - face.centroid()) < 0.0)
    }

    /// Each face as it is.
    pub(crate) fn polygons(&self) -> Vec<ConvexPolygon> {
        self.faces.iter().map(|face| polygon(&self.outline(face))).collect()
    }

    /// Each face as a fan of triangles about a random point in it: coplanar neighbours that share edges.
    pub(crate) fn triangles(&self, random: &mut Random) -> Vec<ConvexPolygon> {
        let mut triangles = Vec::new();
        for face in &self.faces {
            let outline = self.outline(face);
            let hub = point_in(&outline, random);
            for (i, &a) in outline.iter().enumerate() {
                triangles.push(polygon(&[hub, a, outline[(i + 1) % outline.len()]]));
            }
        }
        triangles
    }

    pub(crate) fn outline(&self, face: &[usize]) -> Vec<DVec3> {
        face.iter().map(|&corner| self.corners[corner]).collect()
    }
}

/// A point inside a convex outline, away from its border.
pub(crate) fn point_in(outline: &[DVec3], random: &mut Random) -> DVec3 {
    let weights: Vec<f64> = outline.iter().map(|_| random.between(0.1, 1.0)).collect();
    let sum: f64 = weights.iter().sum();
    outline.iter().zip(&weights).map(|(&vertex, weight)| vertex * (weight / sum)).sum()
}

pub(crate) fn polygon(outline: &[DVec3]) -> ConvexPolygon {
    ConvexPolygon::new(outline).expect("test polygons have area")
}

/// A rectangle from its corner and two sides, counter-clockwise about `u × v`.
pub(crate) fn rectangle(corner: DVec3, u: DVec3, v: DVec3) -> ConvexPolygon {
    polygon(&[corner, corner + u, corner + u + v, corner + v])
}

pub(crate) fn receiver(position: [f64; 3], normal: [f64; 3]) -> Receiver {
    Receiver::new(position.into(), DVec3::from(normal).normalize())
}

/// The visible form factor with every polygon as a candidate.
pub(crate) fn visible(
    receiver: &Receiver,
    source: &ConvexPolygon,
    blockers: &[ConvexPolygon],
) -> VisibleFormFactor {
    let candidates: Vec<u32> = (0..blockers.len() as u32).collect();
    visible_form_factor(receiver, source, blockers, &candidates, &mut Scratch::new())
        .expect("test scenes are simple")
}

/// Nodes and weights of the Gauss-Legendre rule on 0..1, by Newton's method on the Legendre polynomial.
pub(crate) fn gauss_legendre(count: usize) -> Vec<(f64, f64)> {
    let n = count as f64;
    let legendre = |x: f64| {
        let (mut previous, mut current) = (1.0, x);
        for k in 1..count {
            let k = k as f64;
            (previous, current) = (current, ((2.0 * k + 1.0) * x * current - k * previous) / (k + 1.0));
        }
        (current, n * (x * current - previous) / (x * x - 1.0))
    };
    (0..count)
        .map(|i| {
            let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5)).cos();
            for _ in 0..10 {
                let (value, slope) = legendre(x);
                x -= value / slope;
            }
            let slope = legendre(x).1;
            (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

/// The same on pieces of 0..1 that halve towards 0: for what is not smooth there.
pub(crate) fn graded_towards_0(count: usize, levels: i32) -> Vec<(f64, f64)> {
    let rule = gauss_legendre(count);
    let mut nodes = Vec::new();
    for level in 0..=levels {
        let high = 0.5_f64.powi(level);
        let low = if level == levels { 0.0 } else { 0.5 * high };
        nodes.extend(rule.iter().map(|(x, weight)| (low + (high - low) * x, (high - low) * weight)));
    }
    nodes
}
