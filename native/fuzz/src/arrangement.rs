//! Lines on a face.

use crate::bytes::Bytes;

/// Any lines cut a face into triangles that fill it once, or are said to be too many.
pub fn arrangement(bytes: &[u8]) {
    let mut bytes = Bytes::new(bytes);
    let count = bytes.up_to(40);
    let mut points: Vec<[u32; 2]> = Vec::new();
    let point = |bytes: &mut Bytes, points: &mut Vec<[u32; 2]>| {
        let before = points.get(usize::from(bytes.byte()) % points.len().max(1)).copied();
        let point = match (bytes.byte() % 8, before) {
            // The same once more, or some cells beside it
            (0 | 1, Some(before)) => before,
            (2 | 3, Some([u, v])) => {
                let by = |bytes: &mut Bytes| i32::from(bytes.byte() as i8) as u32;
                [u.wrapping_add(by(bytes)), v.wrapping_add(by(bytes))]
            }
            (4, _) => [bytes.integer() >> 22 << 22, bytes.integer() >> 22 << 22],
            (5, _) => [0, bytes.integer()],
            _ => [bytes.integer(), bytes.integer()],
        };
        points.push(point);
        point
    };
    let lines: Vec<([[u32; 2]; 2], u8)> = (0..count)
        .map(|_| ([point(&mut bytes, &mut points), point(&mut bytes, &mut points)], bytes.byte()))
        .collect();
    let count = bytes.up_to(6);
    let more: Vec<(u8, u32)> = (0..count).map(|_| (bytes.byte(), bytes.integer())).collect();
    antumbra::fuzzing::partition_of(&lines, &more);
}
