//! Lines that break triangulations, from a seed.

use glam::DVec2;

use super::super::{Line, LineKind, Partition, Unarranged, border_crossings, partition};
use crate::mesh::grid::{CORNERS, GRID, GridPoint};

/// Steele, Lea and Flood's `SplitMix64`.
#[derive(Debug, Clone)]
pub(super) struct Random(pub(super) u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub(super) fn below(&mut self, end: i32) -> i32 {
        ((u128::from(self.bits()) * end as u128) >> 64) as i32
    }

    /// From `-radius` to `radius`.
    fn around(&mut self, radius: i32) -> i32 {
        self.below(2 * radius + 1) - radius
    }

    fn inside(&mut self) -> GridPoint {
        let (u, v) = (self.below(GRID + 1), self.below(GRID + 1));
        if u + v <= GRID { GridPoint { u, v } } else { GridPoint { u: GRID - u, v: GRID - v } }
    }

    fn on_border(&mut self) -> GridPoint {
        GridPoint::on_edge(self.below(3) as usize, self.below(GRID + 1))
    }

    fn corner(&mut self) -> GridPoint {
        CORNERS[self.below(3) as usize]
    }

    /// Near a point, on the face.
    fn near(&mut self, point: GridPoint, radius: i32) -> GridPoint {
        let u = (point.u + self.around(radius)).clamp(0, GRID);
        GridPoint { u, v: (point.v + self.around(radius)).clamp(0, GRID - u) }
    }

    fn kind(&mut self) -> LineKind {
        if self.below(3) == 0 { LineKind::Contact } else { LineKind::Shadow }
    }

    fn on_lattice(&mut self, cells: i32) -> GridPoint {
        let u = self.below(cells + 1);
        let v = self.below(cells + 1 - u);
        GridPoint { u: u * (GRID / cells), v: v * (GRID / cells) }
    }
}

pub(super) const FAMILIES: [&str; 17] = [
    "random",
    "short",
    "tiny",
    "pencil",
    "lattice",
    "coarse lattice",
    "collinear",
    "near-coincident",
    "bundle",
    "corners",
    "fan",
    "borders",
    "along the border",
    "touching the border",
    "corner cluster",
    "points",
    "beside the border",
];

/// Lines of one family, around what the whole case has in common.
struct Family {
    name: &'static str,
    centre: GridPoint,
    base: [GridPoint; 2],
    cells: i32,
    spread: i32,
}

impl Family {
    fn new(name: &'static str, random: &mut Random) -> Self {
        let base = if random.below(2) == 0 {
            [random.on_border(), random.on_border()]
        } else {
            [random.inside(), random.inside()]
        };
        let (cells, spread) = (1 << (1 + random.below(4)), 1 + random.below(10));
        Self { name, centre: random.inside(), base, cells, spread }
    }

    fn ends(&self, random: &mut Random) -> [GridPoint; 2] {
        let Self { centre, base, spread, .. } = *self;
        match self.name {
            "random" => [random.inside(), random.inside()],
            "short" => {
                let from = random.inside();
                [from, random.near(from, GRID / 50)]
            }
            "tiny" => {
                let from = random.near(centre, 60);
                [from, random.near(from, 12)]
            }
            "pencil" => clipped([centre, random.inside()]),
            "lattice" => [random.on_lattice(64), random.on_lattice(64)],
            "coarse lattice" => [random.on_lattice(self.cells), random.on_lattice(self.cells)],
            "collinear" => {
                let jitter = random.below(2);
                [0, 1].map(|_| {
                    let point = between(base, f64::from(random.below(1 << 20)) / f64::from(1 << 20));
                    random.near(point, jitter)
                })
            }
            "near-coincident" => base.map(|end| random.near(end, spread)),
            "bundle" => {
                let [from, to] = base.map(|end| random.near(end, 1000 * spread));
                [from, random.near(to, 1000 * spread)]
            }
            "corners" => {
                let corner = random.corner();
                let radius = 1 << random.below(8);
                [random.near(corner, radius), random.inside()]
            }
            "fan" => [base[0], random.on_border()],
            "borders" => [random.on_border(), random.on_border()],
            "along the border" | "beside the border" => {
                let edge = random.below(3) as usize;
                let depth = if self.name == "along the border" { random.below(4) } else { 3 * spread };
                [0, 1].map(|_| {
                    let position = random.below(GRID);
                    random.near(GridPoint::on_edge(edge, position), depth)
                })
            }
            "touching the border" => {
                let (end, radius) = (random.on_border(), random.below(6));
                [random.near(end, radius), random.inside()]
            }
            "corner cluster" => {
                let scale = GRID / 5000;
                [0, 1]
                    .map(|_| {
                        let point = random.inside();
                        GridPoint { u: GRID - scale + point.u / 5000, v: point.v / 5000 }
                    })
                    .map(|GridPoint { u, v }| GridPoint { u, v: v.min(GRID - u) })
            }
            "points" => [random.near(centre, 100 * spread); 2],
            unknown => unreachable!("no family is called {unknown}"),
        }
    }
}

fn between([a, b]: [GridPoint; 2], t: f64) -> GridPoint {
    let mix = |p: i32, q: i32| (f64::from(p) + t * (f64::from(q) - f64::from(p))).round() as i32;
    let u = mix(a.u, b.u).clamp(0, GRID);
    GridPoint { u, v: mix(a.v, b.v).clamp(0, GRID - u) }
}

/// The line through two points, extended to the border of the face.
fn clipped([a, b]: [GridPoint; 2]) -> [GridPoint; 2] {
    let (mut first, mut last) = ((f64::NEG_INFINITY, 0), (f64::INFINITY, 0));
    for edge in 0..3 {
        let (from, to) = (f64::from(a.depth(edge)), f64::from(b.depth(edge)));
        let t = from / (from - to);
        if from < to && t > first.0 {
            first = (t, edge);
        } else if from > to && t < last.0 {
            last = (t, edge);
        }
    }
    [first, last].map(|(t, edge)| {
        if !t.is_finite() {
            return a;
        }
        let (from, to) = (a.barycentric(), b.barycentric());
        let weight = (from + t * (to - from))[(edge + 1) % 3];
        GridPoint::on_edge(edge, ((weight * f64::from(GRID)).round() as i32).clamp(0, GRID))
    })
}

#[derive(Debug, Clone)]
pub(super) struct Case {
    pub(super) family: &'static str,
    pub(super) lines: Vec<Line>,
    /// Border vertices by edge.
    pub(super) crossings: [Vec<i32>; 3],
    pub(super) shape: [DVec2; 3],
}

impl Case {
    /// A small case of any family, or of several at once.
    pub(super) fn from_seed(seed: u64) -> Self {
        let mut random = Random(seed.wrapping_mul(0x2545_f491_4f6c_dd1d));
        let count = match random.below(20) {
            0 => 60 + random.below(140),
            1..4 => 20 + random.below(40),
            _ => 1 + random.below(20),
        };
        let families: Vec<Family> = (0..=random.below(5) / 2 * random.below(3))
            .map(|_| Family::new(FAMILIES[random.below(FAMILIES.len() as i32) as usize], &mut random))
            .collect();
        let mut case = Self::of_families(&families, count, &mut random);
        let copies = random.below(count + 1) * (random.below(4) / 3);
        for _ in 0..copies {
            let mut line = case.lines[random.below(count) as usize];
            line.kind = random.kind();
            case.lines.push(line);
        }
        case.disturb_border(&mut random);
        case
    }

    /// So many lines of one family, on a face with no other border vertices than theirs.
    pub(super) fn random(seed: u64, family: &'static str, count: i32) -> Self {
        let mut random = Random(seed);
        let family = Family::new(family, &mut random);
        Self::of_families(&[family], count, &mut random)
    }

    fn of_families(families: &[Family], count: i32, random: &mut Random) -> Self {
        let line = |k: i32| {
            let ends = families[k as usize % families.len()].ends(random);
            Line { ends, kind: random.kind() }
        };
        let lines: Vec<Line> = (0..count).map(line).collect();
        let crossings = border_crossings(&lines);
        let mut coordinate = || f64::from(random.around(1000)) * 0.01;
        let thinness = [1.0, 1.0, 0.1, 1e-4, 0.0][(coordinate().abs() * 10.0) as usize % 5];
        let shape = [0; 3].map(|_| DVec2::new(coordinate(), thinness * coordinate()));
        Self { family: families[0].name, lines, crossings, shape }
    }

    /// What neighbours do to a border: more vertices, moved vertices, vertices side by side, none.
    fn disturb_border(&mut self, random: &mut Random) {
        for positions in &mut self.crossings {
            match random.below(8) {
                0 => positions.clear(),
                1 => positions.extend((0..random.below(10)).map(|_| random.below(GRID))),
                2 => positions.iter_mut().for_each(|position| *position += random.around(20)),
                3 => {
                    let beside: Vec<i32> =
                        positions.iter().flat_map(|&p| [p - 1, p + 1, p + 2, p + 3]).collect();
                    positions.extend(beside);
                }
                4 => {
                    let first = random.below(GRID);
                    positions.extend(first..first + random.below(20));
                    positions.extend([1, 2, GRID - 1, GRID - 3]);
                }
                _ => {}
            }
            positions.retain(|&position| position > 0 && position < GRID);
            positions.sort_unstable();
            positions.dedup();
        }
    }

    pub(super) fn border(&self) -> [&[i32]; 3] {
        [0, 1, 2].map(|edge| &self.crossings[edge][..])
    }

    pub(super) fn partition(&self) -> Result<Partition, Unarranged> {
        partition(self.border(), &self.lines, Some(self.shape))
    }
}
