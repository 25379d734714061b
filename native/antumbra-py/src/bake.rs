//! `Bake` and `BakedMesh`: the solver's result as numpy arrays that share its memory.

use antumbra::weld;
use numpy::{PyArray1, PyArray2, PyArray3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyList;

use crate::arrays::into_numpy;

/// The refined meshes with their light, and what it took to make them.
#[pyclass(frozen, get_all, module = "antumbra_native")]
pub(crate) struct Bake {
    /// One `BakedMesh` per receiving object, in the order of the input.
    meshes: Py<PyList>,
    /// The report as JSON.
    report: String,
}

impl Bake {
    /// Hands the solver's result to Python.
    pub(crate) fn new(py: Python<'_>, bake: weld::Bake) -> PyResult<Self> {
        let report =
            serde_json::to_string(&bake.report).map_err(|error| PyValueError::new_err(error.to_string()))?;
        Ok(Self { meshes: list_of_meshes(py, bake.meshes)?, report })
    }
}

/// Meshes for Python.
pub(crate) fn list_of_meshes(py: Python<'_>, meshes: Vec<weld::BakedMesh>) -> PyResult<Py<PyList>> {
    let meshes = meshes.into_iter().map(|mesh| Py::new(py, BakedMesh::new(py, mesh)?));
    Ok(PyList::new(py, meshes.collect::<PyResult<Vec<_>>>()?)?.unbind())
}

/// A refined triangle mesh; see `antumbra_native.pyi` for what each array means.
#[pyclass(frozen, get_all, module = "antumbra_native")]
pub(crate) struct BakedMesh {
    object: usize,
    positions: Py<PyArray2<f64>>,
    vertex_source_triangle: Py<PyArray1<i32>>,
    vertex_barycentric: Py<PyArray2<f64>>,
    triangles: Py<PyArray2<i32>>,
    source_triangle: Py<PyArray1<i32>>,
    corner_barycentric: Py<PyArray3<f64>>,
    source_edge: Py<PyArray2<i8>>,
    edge_line: Py<PyArray2<i8>>,
    corner_radiance: Py<PyArray3<f32>>,
    corner_error: Option<Py<PyArray2<f32>>>,
    corner_direct: Option<Py<PyArray3<f32>>>,
    corner_indirect: Option<Py<PyArray3<f32>>>,
}

impl BakedMesh {
    fn new(py: Python<'_>, mesh: weld::BakedMesh) -> PyResult<Self> {
        let vertices = mesh.positions.len();
        let triangles = mesh.triangles.len();
        // Blender's indices are i32, so the arrays are typed for its foreach_set; a mesh that large fits no memory.
        if vertices > i32::MAX as usize || triangles > i32::MAX as usize {
            return Err(PyValueError::new_err(
                "the baked mesh has more than 2147483647 vertices or triangles",
            ));
        }
        let layers = mesh.corner_layers.map(|layers| [layers.direct, layers.indirect]);
        let [corner_direct, corner_indirect] = match layers {
            Some([direct, indirect]) => [
                Some(into_numpy(py, direct, [triangles, 3, 3])?),
                Some(into_numpy(py, indirect, [triangles, 3, 3])?),
            ],
            None => [None, None],
        };
        let corner_error = (!mesh.corner_error.is_empty())
            .then(|| into_numpy(py, mesh.corner_error, [triangles, 3]))
            .transpose()?;
        Ok(Self {
            object: mesh.object,
            positions: into_numpy(py, mesh.positions, [vertices, 3])?,
            vertex_source_triangle: into_numpy(py, mesh.vertex_source_triangle, [vertices])?,
            vertex_barycentric: into_numpy(py, mesh.vertex_barycentric, [vertices, 3])?,
            triangles: into_numpy(py, mesh.triangles, [triangles, 3])?,
            source_triangle: into_numpy(py, mesh.source_triangle, [triangles])?,
            corner_barycentric: into_numpy(py, mesh.corner_barycentric, [triangles, 3, 3])?,
            source_edge: into_numpy(py, mesh.source_edge, [triangles, 3])?,
            edge_line: into_numpy(py, mesh.edge_line, [triangles, 3])?,
            corner_radiance: into_numpy(py, mesh.corner_radiance, [triangles, 3, 3])?,
            corner_error,
            corner_direct,
            corner_indirect,
        })
    }
}
