# SPDX-License-Identifier: GPL-3.0-or-later
"""Small scenes, and what can be measured on a mesh."""

from collections import Counter

import bpy
import numpy as np
from mathutils import Matrix

CUBE_VERTICES = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
CUBE_FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def link(obj, collection=None):
    (collection or bpy.context.scene.collection).objects.link(obj)
    return obj


def add_mesh(name, vertices, faces, collection=None, smooth=False):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    mesh.polygons.foreach_set("use_smooth", [smooth] * len(mesh.polygons))
    mesh.update()
    return link(bpy.data.objects.new(name, mesh), collection)


def add_plane(name="Plane", size=2.0, collection=None):
    half = size / 2
    corners = [(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)]
    return add_mesh(name, corners, [(0, 1, 2, 3)], collection)


def add_cube(name="Cube", collection=None, smooth=False):
    return add_mesh(name, CUBE_VERTICES, CUBE_FACES, collection, smooth)


def add_grid(name="Grid", cells=4, size=2.0, smooth=False):
    axis = np.linspace(-size / 2, size / 2, cells + 1)
    vertices = [(x, y, 0) for y in axis for x in axis]
    row = cells + 1
    faces = [
        (j * row + i, j * row + i + 1, (j + 1) * row + i + 1, (j + 1) * row + i)
        for j in range(cells)
        for i in range(cells)
    ]
    return add_mesh(name, vertices, faces, smooth=smooth)


def add_area_light(name="Lamp", location=(0, 0, 3), size=1.0, energy=100.0, shape="SQUARE", size_y=1.0):
    light = bpy.data.lights.new(name, "AREA")
    light.shape, light.size, light.size_y, light.energy = shape, size, size_y, energy
    obj = link(bpy.data.objects.new(name, light))
    obj.location = location
    return obj


def add_material(name, shader="BSDF_DIFFUSE", **inputs):
    """A material of one shader; inputs by name with _ for spaces."""
    material = bpy.data.materials.new(name)
    # From 5.0 on, materials have nodes from the start.
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    output = nodes.new("ShaderNodeOutputMaterial")
    node = nodes.new({"BSDF_DIFFUSE": "ShaderNodeBsdfDiffuse", "EMISSION": "ShaderNodeEmission"}.get(shader, shader))
    for key, value in inputs.items():
        node.inputs[key.replace("_", " ")].default_value = value
    links.new(node.outputs[0], output.inputs["Surface"])
    return material


def add_instances_by_nodes(obj, instanced):
    """Put an instance of `instanced` on every vertex of obj, and keep obj's own mesh."""
    tree = bpy.data.node_groups.new("Instances", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    source = tree.nodes.new("NodeGroupInput")
    target = tree.nodes.new("NodeGroupOutput")
    on_points = tree.nodes.new("GeometryNodeInstanceOnPoints")
    info = tree.nodes.new("GeometryNodeObjectInfo")
    info.inputs["Object"].default_value = instanced
    info.inputs["As Instance"].default_value = True
    join = tree.nodes.new("GeometryNodeJoinGeometry")
    tree.links.new(source.outputs[0], on_points.inputs["Points"])
    tree.links.new(info.outputs["Geometry"], on_points.inputs["Instance"])
    tree.links.new(on_points.outputs[0], join.inputs[0])
    tree.links.new(source.outputs[0], join.inputs[0])
    tree.links.new(join.outputs[0], target.inputs[0])
    obj.modifiers.new("Instances", "NODES").node_group = tree


def select(*objects):
    # New objects take a selection only once the view layer knows them.
    bpy.context.view_layer.update()
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in objects)
    bpy.context.view_layer.objects.active = objects[0] if objects else None


def add_cubes_below_a_lamp():
    """Four cubes in a row on a large plane."""
    for index in range(4):
        add_cube(f"Cube {index}").location = (3 * index, 0, 1)
    add_plane(size=20.0)
    add_area_light(location=(1, 1, 6))


def bake(**settings):
    """Bake from Python with a coarse tolerance, as fast as it goes."""
    for name, value in {"tolerance": 0.1, "receivers": "ALL", **settings}.items():
        setattr(bpy.context.scene.antumbra, name, value)
    assert bpy.ops.antumbra.bake() == {"FINISHED"}


def baked_objects():
    collection = bpy.context.scene.collection.children.get("Antumbra")
    return list(collection.objects) if collection else []


def baked_of(source_name):
    (found,) = (obj for obj in baked_objects() if obj["antumbra_source"] == source_name)
    return found


def positions(mesh):
    values = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
    mesh.vertices.foreach_get("co", values)
    return values.reshape(-1, 3)


def world_positions(obj):
    matrix = np.array(obj.matrix_world)
    return positions(obj.data) @ matrix[:3, :3].T + matrix[:3, 3]


def corner_vertices(mesh):
    values = np.empty(len(mesh.loops), dtype=np.int32)
    mesh.loops.foreach_get("vertex_index", values)
    return values


def radiance(mesh, name="Radiosity"):
    """(corners, 3)"""
    values = np.empty(len(mesh.loops) * 4, dtype=np.float32)
    mesh.color_attributes[name].data.foreach_get("color", values)
    return values.reshape(-1, 4)[:, :3]


def radiance_at(obj, point):
    """Colours of all corners at a world position."""
    at = np.linalg.norm(world_positions(obj) - point, axis=1) < 1e-5
    colours = radiance(obj.data)[at[corner_vertices(obj.data)]]
    assert len(colours), f"{obj.name} has no vertex at {point}"
    return colours


def face_areas(mesh):
    values = np.empty(len(mesh.polygons), dtype=np.float32)
    mesh.polygons.foreach_get("area", values)
    return values


def faces_per_edge(mesh):
    edges = np.empty(len(mesh.loops), dtype=np.int32)
    mesh.loops.foreach_get("edge_index", edges)
    return np.bincount(edges, minlength=len(mesh.edges))


def sheared(x_by_z):
    matrix = Matrix.Identity(4)
    matrix[0][2] = x_by_z
    return matrix


def sources():
    """How many objects were baked, by the names of their sources."""
    return Counter(obj["antumbra_source"] for obj in baked_objects())


def bake_below_a_lamp(**settings):
    add_area_light(location=(0, 0, 6), size=2.0, energy=500.0)
    bake(**settings)


def assert_lit_from_above(obj):
    """What faces up has light, and all of it is finite."""
    mesh, light = obj.data, radiance(obj.data)
    assert len(mesh.polygons) > 0
    assert np.isfinite(light).all()
    normals = np.empty(len(mesh.polygons) * 3, dtype=np.float32)
    mesh.polygons.foreach_get("normal", normals)
    turned = normals.reshape(-1, 3) @ np.linalg.inv(np.array(obj.matrix_world)[:3, :3])
    up = np.repeat(turned[:, 2] > 0.5 * np.linalg.norm(turned, axis=1), 3)
    assert up.any()
    assert light[up].max() > 0.0


def middle_of(obj):
    """Of its bounding box."""
    points = world_positions(obj)
    return 0.5 * (points.min(axis=0) + points.max(axis=0))
