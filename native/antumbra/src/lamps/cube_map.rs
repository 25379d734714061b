//! Directions as cells on the faces of a cube, from whole faces to the finest squares, and what comes from each.

use glam::DVec3;

/// Cells of one size: face by face, row by row.
#[derive(Debug)]
struct Level {
    /// pi times the mean radiance, W/m².
    exitance: Vec<DVec3>,
    /// The root mean square of what its parts differ from it by, over the channels, W/m².
    spread: Vec<f64>,
}

/// What is sent from all directions.
#[derive(Debug)]
pub(super) struct CubeMap {
    /// From whole faces to the finest cells.
    levels: Vec<Level>,
}

/// A square on a face of the cube.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cell {
    face: usize,
    pub(super) level: u32,
    /// From -1 on, along the two axes that follow the face's.
    column: usize,
    row: usize,
}

impl Cell {
    fn per_side(self) -> usize {
        1 << self.level
    }

    /// The direction of a point of it, 0 to 1 along both axes: one where the cube's half side is one.
    pub(super) fn direction(self, across: f64, along: f64) -> DVec3 {
        let size = 2.0 / self.per_side() as f64;
        let axis = self.face / 2;
        let mut direction = DVec3::ZERO;
        direction[axis] = [1.0, -1.0][self.face % 2];
        direction[(axis + 1) % 3] = (self.column as f64 + across) * size - 1.0;
        direction[(axis + 2) % 3] = (self.row as f64 + along) * size - 1.0;
        direction
    }

    /// Counter-clockwise seen from the middle of the cube.
    pub(super) fn corners(self) -> [DVec3; 4] {
        let mut corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(u, v)| self.direction(u, v));
        if self.face.is_multiple_of(2) {
            corners.reverse();
        }
        corners
    }

    /// No form factor of it is larger, about: its solid angle over pi, taken from its middle.
    pub(super) fn most(self) -> f64 {
        let size = 2.0 / self.per_side() as f64;
        let distance = self.direction(0.5, 0.5).length();
        (size * size / (std::f64::consts::PI * distance.powi(3))).min(1.0)
    }

    pub(super) fn parts(self) -> [Self; 4] {
        [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(column, row)| Self {
            level: self.level + 1,
            column: 2 * self.column + column,
            row: 2 * self.row + row,
            ..self
        })
    }

    /// A number of its own, for rays.
    pub(super) fn seed(self) -> u64 {
        ((self.face as u64) << 56)
            | (u64::from(self.level) << 48)
            | ((self.column as u64) << 24)
            | self.row as u64
    }
}

impl CubeMap {
    /// `finest`: pi times the radiance of the cells of a power of two per side, face by face, row by row, W/m².
    pub(super) fn new(cells_per_side: usize, finest: Vec<DVec3>) -> Self {
        let mut levels = vec![Level { spread: vec![0.0; finest.len()], exitance: finest }];
        for level in (0..cells_per_side.trailing_zeros()).rev() {
            let coarser = Level::of_parts(&levels[levels.len() - 1], level);
            levels.push(coarser);
        }
        levels.reverse();
        Self { levels }
    }

    /// What a cell sends, and how much that differs within it. Cells finer than those known are as these.
    pub(super) fn sends(&self, cell: Cell) -> (DVec3, f64) {
        let depth = (self.levels.len() - 1).min(cell.level as usize);
        let finer = cell.level as usize - depth;
        let per_side = 1 << depth;
        let index = (cell.face * per_side + (cell.row >> finer)) * per_side + (cell.column >> finer);
        let Level { exitance, spread } = &self.levels[depth];
        (exitance[index], spread[index])
    }

    /// What is sent from a direction, W/m²: pi times the radiance there.
    pub(super) fn towards(&self, direction: DVec3) -> DVec3 {
        let size = direction.abs();
        let axis = (1..3).fold(0, |largest, axis| if size[axis] > size[largest] { axis } else { largest });
        let away = size[axis];
        let level = self.levels.len() as u32 - 1;
        let per_side = 1_usize << level;
        let place = |axis: usize| {
            let across = 0.5 * (direction[axis % 3] / away + 1.0);
            ((across * per_side as f64) as usize).min(per_side - 1)
        };
        let face = 2 * axis + usize::from(direction[axis] < 0.0);
        self.sends(Cell { face, level, column: place(axis + 1), row: place(axis + 2) }).0
    }

    /// The mean of what is sent and taken away, W/m².
    pub(super) fn mean(&self) -> DVec3 {
        let finest = &self.levels[self.levels.len() - 1].exitance;
        finest.iter().map(|exitance| exitance.abs()).sum::<DVec3>() / finest.len() as f64
    }
}

/// The whole faces of the cube.
pub(super) fn faces() -> impl Iterator<Item = Cell> {
    (0..6).map(|face| Cell { face, level: 0, column: 0, row: 0 })
}

impl Level {
    /// The cells that are twice as large as those of a level, at the level above it.
    fn of_parts(finer: &Self, level: u32) -> Self {
        let per_side = 1 << level;
        let mut this = Self { exitance: Vec::new(), spread: Vec::new() };
        for face in 0..6 {
            for row in 0..per_side {
                for column in 0..per_side {
                    let parts = Cell { face, level, column, row }.parts();
                    let index = |part: &Cell| (face * 2 * per_side + part.row) * 2 * per_side + part.column;
                    // By solid angle
                    let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
                    for part in &parts {
                        let weight = part.direction(0.5, 0.5).length().powi(-3);
                        sum += weight * finer.exitance[index(part)];
                        weights += weight;
                    }
                    let mean = sum / weights;
                    let squared = |part: &Cell| {
                        let deviation = (finer.exitance[index(part)] - mean).abs().max_element();
                        let weight = part.direction(0.5, 0.5).length().powi(-3);
                        weight * (deviation * deviation + finer.spread[index(part)].powi(2))
                    };
                    let spread = (parts.iter().map(squared).sum::<f64>() / weights).sqrt();
                    this.exitance.push(mean);
                    this.spread.push(spread);
                }
            }
        }
        this
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(cells_per_side: usize, sends: impl Fn(DVec3) -> f64) -> CubeMap {
        let level = cells_per_side.trailing_zeros();
        let mut exitance = Vec::new();
        for face in 0..6 {
            for row in 0..cells_per_side {
                for column in 0..cells_per_side {
                    let cell = Cell { face, level, column, row };
                    exitance.push(DVec3::splat(sends(cell.direction(0.5, 0.5).normalize())));
                }
            }
        }
        CubeMap::new(cells_per_side, exitance)
    }

    #[test]
    fn a_direction_sees_the_cell_that_it_points_to() {
        let sends = |direction: DVec3| 2.0 + direction.x + 0.3 * direction.y - 0.5 * direction.z;
        let map = map(4, sends);
        for face in faces() {
            for cell in face.parts().into_iter().flat_map(Cell::parts) {
                assert_eq!(map.towards(cell.direction(0.4, 0.7)), map.sends(cell).0);
            }
        }
    }

    #[test]
    fn means_and_spreads_of_cells_hold_their_parts() {
        let map = map(8, |d| if d.z > 0.9 && d.x > 0.2 { 100.0 } else { 1.0 + d.z });
        // A whole face's spread is the deviation of its finest cells from its mean.
        let finest = &map.levels[3].exitance;
        for face in 0..6 {
            let (mean, spread) = map.sends(Cell { face, level: 0, column: 0, row: 0 });
            let (mut squared, mut weights) = (0.0, 0.0);
            for (index, exitance) in finest.iter().enumerate().skip(64 * face).take(64) {
                let cell = Cell { face, level: 3, column: index % 8, row: index / 8 % 8 };
                let weight = cell.direction(0.5, 0.5).length().powi(-3);
                squared += weight * (exitance.x - mean.x).powi(2);
                weights += weight;
            }
            // Weights of coarser cells are not quite the sums of those of their parts.
            assert!((spread / f64::sqrt(squared / weights) - 1.0).abs() < 0.05, "{spread}");
        }
        let whole: f64 = map.levels[0].exitance.iter().map(|e| e.x).sum::<f64>() / 6.0;
        assert!((1.0..20.0).contains(&whole));
    }
}
