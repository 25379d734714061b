//! The sky as random paths look for it: a cell, the likelier the more it sends.

use glam::DVec3;

use crate::scene::SkyInput;
use crate::transport::gather::rms;

/// The cells of the sky, chosen by their light.
pub(super) struct Sky {
    per_side: usize,
    /// W/m².
    exitance: Vec<DVec3>,
    /// Share of the choices up to and with each cell.
    shares: Vec<f64>,
    /// Mean over all directions and the channels, W/m².
    brightness: f64,
}

impl Sky {
    pub(super) fn new(input: &SkyInput) -> Option<Self> {
        let per_side = input.cells_per_side;
        let exitance: Vec<DVec3> = input.exitance_rgb.iter().map(|&rgb| DVec3::from_array(rgb)).collect();
        let mut shares = Vec::with_capacity(exitance.len());
        let mut sum = 0.0;
        for (cell, light) in exitance.iter().enumerate() {
            let [_, row, column] = Self::place(per_side, cell);
            let middle = |k: usize| (2 * k + 1) as f64 / per_side as f64 - 1.0;
            sum += rms(*light) / (1.0 + middle(row).powi(2) + middle(column).powi(2)).powf(1.5);
            shares.push(sum);
        }
        if sum <= 0.0 {
            return None;
        }
        for share in &mut shares {
            *share /= sum;
        }
        let brightness = exitance.iter().map(|light| rms(*light)).sum::<f64>() / exitance.len() as f64;
        Some(Self { per_side, exitance, shares, brightness })
    }

    /// What a cell sends, W/m².
    pub(super) fn sends(&self, cell: usize) -> DVec3 {
        self.exitance[cell]
    }

    /// The mean of that over all directions and the channels, W/m².
    pub(super) fn brightness(&self) -> f64 {
        self.brightness
    }

    fn place(per_side: usize, cell: usize) -> [usize; 3] {
        let (line, column) = (cell / per_side, cell % per_side);
        [line / per_side, line % per_side, column]
    }

    /// Density per solid angle with which a direction in a cell is chosen: uniform on the cube's face within the cell.
    fn density(&self, cell: usize, [across, along]: [f64; 2]) -> f64 {
        let before = if cell > 0 { self.shares[cell - 1] } else { 0.0 };
        let size = 2.0 / self.per_side as f64;
        (self.shares[cell] - before) * (1.0 + across * across + along * along).powf(1.5) / (size * size)
    }

    /// A direction, its cell and its density.
    pub(super) fn choose(&self, [u, v]: [f64; 2]) -> (DVec3, usize, f64) {
        let cell = self.shares.partition_point(|&share| share <= u).min(self.shares.len() - 1);
        let before = if cell > 0 { self.shares[cell - 1] } else { 0.0 };
        // What is left of the number is as random within the cell.
        let u = ((u - before) / (self.shares[cell] - before)).clamp(0.0, 1.0);
        let [face, row, column] = Self::place(self.per_side, cell);
        let size = 2.0 / self.per_side as f64;
        let on_face = [(column as f64 + u) * size - 1.0, (row as f64 + v) * size - 1.0];
        let axis = face / 2;
        let mut direction = DVec3::ZERO;
        direction[axis] = if face.is_multiple_of(2) { 1.0 } else { -1.0 };
        direction[(axis + 1) % 3] = on_face[0];
        direction[(axis + 2) % 3] = on_face[1];
        (direction.normalize(), cell, self.density(cell, on_face))
    }

    /// The cell in a direction, and the density with which that is chosen.
    pub(super) fn cell(&self, direction: DVec3) -> (usize, f64) {
        let size = direction.abs();
        let axis = if size.x >= size.y && size.x >= size.z {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        let on_face = [1, 2].map(|next| direction[(axis + next) % 3] / size[axis]);
        let [column, row] =
            on_face.map(|at| ((0.5 * (at + 1.0) * self.per_side as f64) as usize).min(self.per_side - 1));
        let face = 2 * axis + usize::from(direction[axis] < 0.0);
        let cell = (face * self.per_side + row) * self.per_side + column;
        (cell, self.density(cell, on_face))
    }
}
