//! What the fuzz targets need of the solver's inside.

use crate::mesh::arrangement::{Line, LineKind, Partition, Unarranged, border_crossings, partition};
use crate::mesh::grid::{GRID, GridPoint};

/// Cuts a face along lines, given by points anywhere and a kind, with more border vertices than they bring.
///
/// # Panics
/// When what comes out is not what [`Partition`] promises, or nothing does although the lines are few.
pub fn partition_of(lines: &[([[u32; 2]; 2], u8)], more: &[(u8, u32)]) {
    let lines: Vec<Line> =
        lines.iter().map(|&(ends, kind)| Line { ends: ends.map(on_face), kind: kind_of(kind) }).collect();
    let mut border = border_crossings(&lines);
    for &(edge, position) in more {
        border[usize::from(edge % 3)].push(1 + (position % (GRID as u32 - 1)) as i32);
    }
    for positions in &mut border {
        positions.sort_unstable();
        positions.dedup();
    }
    let border = [0, 1, 2].map(|edge| &border[edge][..]);
    match partition(border, &lines, None) {
        Ok(partition) => assert_eq!(partition.check(border), Ok(())),
        Err(refused) => assert_eq!(refused, Unarranged::TooMany),
    }
    assert_eq!(Partition::plain(border, None).check(border), Ok(()));
}

fn on_face([u, v]: [u32; 2]) -> GridPoint {
    let [u, v] = [u, v].map(|w| (w % (GRID as u32 + 1)) as i32);
    if u + v <= GRID { GridPoint { u, v } } else { GridPoint { u: GRID - u, v: GRID - v } }
}

fn kind_of(byte: u8) -> LineKind {
    [LineKind::Shadow, LineKind::Sharp, LineKind::Contact][usize::from(byte % 3)]
}
