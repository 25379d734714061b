# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials with more than one node."""

import numpy as np


def shader_of(material):
    return material.node_tree.get_output_node("ALL").inputs["Surface"].links[0].from_node


def with_node(material, node_type, socket="Color", output="Color"):
    """Link a new node to an input of the material's shader."""
    node = material.node_tree.nodes.new(node_type)
    material.node_tree.links.new(node.outputs[output], shader_of(material).inputs[socket])
    return node


def link(material, from_node, output, to_node, socket):
    material.node_tree.links.new(from_node.outputs[output], to_node.inputs[socket])


def add_uv_map(obj):
    """Each face has the whole texture."""
    layer = obj.data.uv_layers.new(name="UV")
    layer.uv.foreach_set("vector", np.tile(np.float32([0, 0, 1, 0, 1, 1, 0, 1]), len(obj.data.polygons)))


def unreadable_grey(tree, value=0.5):
    """A colour that is constant, but not for who reads nodes only."""
    node = tree.nodes.new("ShaderNodeMapRange")
    node.inputs["Value"].default_value = value
    return node.outputs[0]
