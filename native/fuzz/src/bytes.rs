//! Numbers and shapes from bytes.

use antumbra::visibility::ConvexPolygon;
use arbitrary::Unstructured;
use glam::DVec3;

/// Bytes that are read as numbers, zeros after their end.
pub struct Bytes<'a>(Unstructured<'a>);

impl<'a> Bytes<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self(Unstructured::new(bytes))
    }

    pub fn byte(&mut self) -> u8 {
        self.0.arbitrary().unwrap_or(0)
    }

    /// From 0 to `most`.
    pub fn up_to(&mut self, most: u8) -> usize {
        usize::from(self.byte() % (most + 1))
    }

    pub fn coin(&mut self) -> bool {
        self.byte() & 1 == 1
    }

    /// One of these.
    pub fn of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[usize::from(self.byte()) % choices.len()]
    }

    pub fn integer(&mut self) -> u32 {
        self.0.arbitrary().unwrap_or(0)
    }

    /// From 0 to 1.
    pub fn share(&mut self) -> f64 {
        f64::from(self.integer()) / f64::from(u32::MAX)
    }

    /// From -1 to 1: on a lattice, where planes and edges coincide, beside it, or anywhere.
    pub fn coordinate(&mut self) -> f64 {
        let on_lattice = f64::from((self.byte() % 9) as i8 - 4) / 4.0;
        match self.byte() % 8 {
            0..5 => on_lattice,
            5 => (on_lattice + f64::from(self.byte() as i8) * 1e-14).clamp(-1.0, 1.0),
            6 => (on_lattice + f64::from(self.byte() as i8) * 1e-8).clamp(-1.0, 1.0),
            _ => 2.0 * self.share() - 1.0,
        }
    }

    /// In the cube from -1 to 1.
    pub fn point(&mut self) -> DVec3 {
        DVec3::new(self.coordinate(), self.coordinate(), self.coordinate())
    }

    /// A unit vector.
    pub fn direction(&mut self) -> DVec3 {
        self.point().try_normalize().unwrap_or(DVec3::Z)
    }

    /// A triangle or a parallelogram in the cube from -3 to 3, if it has an area.
    pub fn polygon(&mut self) -> Option<ConvexPolygon> {
        let [a, b, c] = [self.point(), self.point(), self.point()];
        if self.coin() { ConvexPolygon::triangle(a, b, c) } else { ConvexPolygon::new(&[a, b, b + c - a, c]) }
    }

    /// Any number at all, those that are none included.
    pub fn number(&mut self) -> f64 {
        match self.byte() % 16 {
            0..9 => self.coordinate(),
            9 => f64::NAN,
            10 => f64::INFINITY,
            11 => f64::from_bits(self.0.arbitrary().unwrap_or(0)),
            12 => f64::from(f32::from_bits(self.integer())),
            13 => 10.0_f64.powi(i32::from(self.byte() as i8)),
            14 => -1.0,
            _ => 0.0,
        }
    }
}
