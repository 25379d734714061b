//! The mesh before any light: faces cut into patches, patches into elements (the paper, §2.1).

use crate::index::{ElementId, FaceId};
use crate::mesh::{Element, Grading, Mesh};
use crate::scene::world::World;
use crate::settings::{Method, Settings};

/// Patches that the surfaces would be cut into if all were one square, at a tolerance of one per cent. A patch sends
/// its mean: fewer blur light between neighbours, more cost shots. Chosen as a round number of that size, not by a
/// sweep; patches that the emitters light unevenly are cut further.
const PATCHES: f64 = 150.0;

/// Elements of a uniform mesh per patch and edge, at a tolerance of one per cent.
const UNIFORM_ELEMENTS: f64 = 4.0;

/// Edge of the elements that the discontinuity methods start from, in patches: they follow lines, not a grid, but an
/// element must not be so large that the middles of its edges miss the light altogether.
const FACE_ELEMENTS: f64 = 4.0;

/// A face is cut to a 2^10th of its size at most before any light is known.
const DEEPEST_COARSE: u8 = 10;

/// Sizes of the coarse mesh, in metres.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sizes {
    pub(crate) patch: f64,
    pub(crate) element: f64,
    /// How evenly faces are cut that discontinuity methods show.
    pub(crate) grading: Option<Grading>,
}

impl Sizes {
    /// The sizes that the settings ask for, or the automatic ones.
    pub(crate) fn new(world: &World, settings: &Settings) -> Self {
        let fineness = (settings.tolerance / 0.01).sqrt();
        let patch = (world.surface_area() * fineness / PATCHES).sqrt();
        let automatic = match settings.method {
            Method::As => patch,
            Method::Uniform => patch * fineness / UNIFORM_ELEMENTS,
            Method::Adm | Method::Dm => FACE_ELEMENTS * patch,
        };
        let element = if settings.element_size > 0.0 { settings.element_size } else { automatic };
        Self { patch: patch.max(settings.element_size), element, grading: None }
    }
}

/// Times that a patch may be longer than its size when its area is small: the light of a long thin patch changes along
/// it, but a strip is not worth hundreds of squares of its width.
const LONGEST_PATCH: f64 = 4.0;

/// Area, in squares of the size that is wanted, below which an element need not be cut for its length alone. Its quarters are half
/// as long, but four: a hair of half a metre in a scene of hairs, each a thousandth of a millimetre wide, became a million
/// elements. Elements are at most so many times four more than squares of the size would be.
pub(crate) const LEAST_AREA: f64 = 1.0 / 16.0;

/// Cuts the roots into patches: elements of about the area of a square of the given size. In order.
///
/// `least_area`: in such squares, of what is cut for its length alone.
pub(crate) fn cut_into_patches(mesh: &mut Mesh, size: f64, least_area: f64) -> Vec<ElementId> {
    let fits =
        |mesh: &Mesh, element: &Element| fits(element.area, longest_edge(mesh, element), size, least_area);
    let mut patches = Vec::new();
    let mut open: Vec<ElementId> = ElementId::range(0..mesh.roots.len()).rev().collect();
    while let Some(id) = open.pop() {
        let element = mesh.element(id);
        if element.level == DEEPEST_COARSE || fits(mesh, element) {
            patches.push(id);
            continue;
        }
        if element.is_leaf() {
            mesh.subdivide(id, &mut Vec::new());
        }
        let children = mesh.element(id).children().expect("it is subdivided; this is a bug in antumbra");
        open.extend(children.into_iter().rev());
    }
    patches
}

/// How many patches [`cut_into_patches`] makes; a number that need not fit into memory.
pub(crate) fn patches_of(mesh: &Mesh, size: f64, least_area: f64) -> f64 {
    let of_root = |root: ElementId| {
        let element = mesh.element(root);
        let (mut area, mut longest, mut count) = (element.area, longest_edge(mesh, element), 1.0);
        // Quarters of a triangle are like it
        for _ in element.level..DEEPEST_COARSE {
            if fits(area, longest, size, least_area) {
                break;
            }
            (area, longest, count) = (0.25 * area, 0.5 * longest, 4.0 * count);
        }
        count
    };
    ElementId::range(0..mesh.roots.len()).map(of_root).sum()
}

fn fits(area: f64, longest: f64, size: f64, least_area: f64) -> bool {
    area <= least_area * size * size || ((2.0 * area).sqrt() <= size && longest <= LONGEST_PATCH * size)
}

/// Subdivides the faces of what is baked until no edge is longer than `size`; of slivers, unless the user wants that size,
/// not all the way. Returns the level of each face that this takes.
pub(crate) fn subdivide_to(mesh: &mut Mesh, world: &World, size: f64, wanted: bool) -> Vec<u8> {
    let level = |face: FaceId| {
        let [a, b, c] = world.corners(&world.faces[face.index()]);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        let area = 0.5 * (b - a).cross(c - a).length();
        let short = (longest / size).log2().ceil();
        let small = if wanted { f64::INFINITY } else { (area / (LEAST_AREA * size * size)).log2() / 2.0 };
        short.min(small.ceil()).clamp(0.0, f64::from(DEEPEST_COARSE)) as u8
    };
    let levels: Vec<u8> = FaceId::range(0..world.faces.len())
        .map(|face| if world.receives(face) { level(face) } else { 0 })
        .collect();
    let mut index = 0;
    // Children are appended, so this visits every element that it makes.
    while index < mesh.elements.len() {
        let id = ElementId::new(index);
        let element = mesh.element(id);
        if element.is_leaf() && element.level < levels[element.face.index()] {
            mesh.subdivide(id, &mut Vec::new());
        }
        index += 1;
    }
    levels
}

fn longest_edge(mesh: &Mesh, element: &Element) -> f64 {
    let [a, b, c] = mesh.positions(element);
    a.distance(b).max(b.distance(c)).max(c.distance(a))
}
