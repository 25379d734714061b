# SPDX-License-Identifier: GPL-3.0-or-later
"""Copies of materials whose diffuse pass is what a bake wants to know of them.

Cycles' pass of the diffuse colour holds what a surface reflects diffusely below its gloss, and how opaque it is. In the
copy gloss, coat and sheen are taken away, metals are matte where the user wants that, and glass is transparent, so that
the pass says the same as a direct reading of Principled does. Node groups are copied with it.
"""

from __future__ import annotations

from typing import Any

from .temporary import marked, remove

# Layers that take from the diffuse light below them.
_LAYERS = ("Specular IOR Level", "Coat Weight", "Sheen Weight", "Subsurface Weight")

METALS = frozenset({"BSDF_GLOSSY", "BSDF_ANISOTROPIC", "BSDF_METALLIC"})
"""Shaders that reflect like a mirror, more or less."""

GLASS = frozenset({"BSDF_GLASS", "BSDF_REFRACTION"})
"""Shaders that let light through."""

# Nodes that say where a surface is, which object it is on, or what is around it.
_PLACED = frozenset(
    "NEW_GEOMETRY OBJECT_INFO CAMERA VECT_TRANSFORM PARTICLE_INFO HAIR_INFO POINT_INFO LIGHT_PATH TANGENT BEVEL "
    "AMBIENT_OCCLUSION WIREFRAME TEX_POINTDENSITY UVALONGSTROKE SCRIPT".split()
)

GENERATED, OBJECT, PLACED = "GENERATED", "OBJECT", "PLACED"
"""What colours may depend on besides UV maps and attributes: the place in the object's box, the place in its own space,
and anything else about it."""


class NeutralMaterials:
    """Makes each copy once, and takes all of them away again."""

    def __init__(self, metals_are_matte: bool) -> None:
        self._metals_are_matte = metals_are_matte
        self._material_by_uid: dict[int, Any] = {}
        self._tree_by_uid: dict[int, Any] = {}

    def of(self, material: Any) -> Any:
        """The neutral copy of a material."""
        uid = material.session_uid
        if uid not in self._material_by_uid:
            self._material_by_uid[uid] = copy = marked(material.copy())
            self._neutralise(copy.node_tree)
        return self._material_by_uid[uid]

    def remove(self) -> None:
        """Delete all copies."""
        remove([*self._material_by_uid.values(), *self._tree_by_uid.values()])
        self._material_by_uid.clear()
        self._tree_by_uid.clear()

    def _neutralise(self, tree: Any) -> None:
        for node in list(tree.nodes):
            if node.mute:
                continue
            if node.type == "GROUP" and node.node_tree is not None:
                node.node_tree = self._neutral_tree(node.node_tree)
            elif node.type == "BSDF_PRINCIPLED":
                self._neutralise_principled(tree, node)
            elif node.type in GLASS:
                _replace(tree, node, "ShaderNodeBsdfTransparent")
            elif node.type in METALS and self._metals_are_matte:
                _replace(tree, node, "ShaderNodeBsdfDiffuse")

    def _neutral_tree(self, tree: Any) -> Any:
        uid = tree.session_uid
        if uid not in self._tree_by_uid:
            self._tree_by_uid[uid] = copy = marked(tree.copy())
            self._neutralise(copy)
        return self._tree_by_uid[uid]

    def _neutralise_principled(self, tree: Any, node: Any) -> None:
        for name in _LAYERS:
            _set(tree, node.inputs[name], 0.0)
        if self._metals_are_matte:
            _set(tree, node.inputs["Metallic"], 0.0)
        # What goes through the glass below a metal that is none
        through = _math(tree, "SUBTRACT", 1.0, _value(node.inputs["Metallic"]))
        through = _math(tree, "MULTIPLY", _value(node.inputs["Transmission Weight"]), through)
        opaque = _math(tree, "SUBTRACT", 1.0, through)
        alpha = _math(tree, "MULTIPLY", _value(node.inputs["Alpha"]), opaque)
        _set(tree, node.inputs["Transmission Weight"], 0.0)
        _set(tree, node.inputs["Alpha"], alpha)


def trees_of(material: Any) -> list[Any]:
    """The node tree of a material and those of all groups in it."""
    found: dict[int, Any] = {}

    def visit(tree: Any) -> None:
        if tree is None or tree.session_uid in found:
            return
        found[tree.session_uid] = tree
        for node in tree.nodes:
            if node.type == "GROUP":
                visit(node.node_tree)

    visit(material.node_tree)
    return list(found.values())


def may_emit(material: Any) -> bool:
    """Whether any node may send light."""
    for tree in trees_of(material):
        for node in tree.nodes:
            strength = node.inputs.get("Emission Strength") if node.type == "BSDF_PRINCIPLED" else None
            if node.type in ("EMISSION", "BACKGROUND") or (
                strength is not None and (strength.is_linked or strength.default_value != 0.0)
            ):
                return True
    return False


def has_glass(material: Any) -> bool:
    """Whether any node may let light through as glass does."""
    return _may_be(material, GLASS, "Transmission Weight")


def has_metal(material: Any) -> bool:
    """Whether any node may reflect like a metal."""
    return _may_be(material, METALS, "Metallic")


def _may_be(material: Any, types: frozenset[str], share_of_principled: str) -> bool:
    """Whether any node is of some types, or a Principled one with more than nothing of a share."""

    def is_one(node: Any) -> bool:
        if node.type == "BSDF_PRINCIPLED":
            share = node.inputs[share_of_principled]
            return bool(share.is_linked or share.default_value > 0.0)
        return node.type in types

    return any(is_one(node) for tree in trees_of(material) for node in tree.nodes)


def coordinates_of(material: Any) -> set[str]:
    """Which of GENERATED, OBJECT and PLACED a material's colours may depend on."""
    return {kind for tree in trees_of(material) for node in tree.nodes for kind in _coordinates_of_node(node)}


def _coordinates_of_node(node: Any) -> set[str]:
    if node.type == "TEX_COORD":
        in_space = OBJECT if node.object is None else PLACED
        kinds = {"Generated": GENERATED, "Normal": OBJECT, "UV": None, "Object": in_space}
        used = [output.name for output in node.outputs if output.is_linked]
        return {kind for name in used if (kind := kinds.get(name, PLACED)) is not None}
    if node.type == "ATTRIBUTE":
        return set() if str(node.attribute_type) == "GEOMETRY" else {PLACED}
    if node.type == "TEX_IMAGE":
        return set() if node.projection == "FLAT" else {OBJECT}
    if node.type in _PLACED:
        return {PLACED}
    vector = node.inputs.get("Vector") if node.type.startswith("TEX_") else None
    # What a texture is not told it takes from the object's box.
    return {GENERATED} if vector is not None and not vector.is_linked else set()


def attributes_of(material: Any) -> set[str]:
    """Names of attributes that a material asks for."""
    return {node.attribute_name for tree in trees_of(material) for node in tree.nodes if node.type == "ATTRIBUTE"}


def _replace(tree: Any, node: Any, shader: str) -> None:
    """Put another shader of the same colour in a node's place."""
    colour = node.inputs.get("Color") or node.inputs["Base Color"]
    new = tree.nodes.new(shader)
    new.inputs["Color"].default_value = colour.default_value
    if colour.is_linked:
        tree.links.new(colour.links[0].from_socket, new.inputs["Color"])
    for link in list(node.outputs[0].links):
        tree.links.new(new.outputs[0], link.to_socket)
    tree.nodes.remove(node)


def _value(socket: Any) -> Any:
    """A number, or the output that it comes from."""
    return socket.links[0].from_socket if socket.is_linked else float(socket.default_value)


def _set(tree: Any, socket: Any, value: Any) -> None:
    """Give an input a number, or link it to an output."""
    if isinstance(value, float):
        for link in list(socket.links):
            tree.links.remove(link)
        socket.default_value = value
    else:
        tree.links.new(value, socket)


def _math(tree: Any, operation: str, a: Any, b: Any) -> Any:
    """a - b or a · b, as a number where both are."""
    if isinstance(a, float) and isinstance(b, float):
        return a - b if operation == "SUBTRACT" else a * b
    node = tree.nodes.new("ShaderNodeMath")
    node.operation = operation
    for socket, value in zip(node.inputs, (a, b), strict=False):
        _set(tree, socket, value)
    return node.outputs[0]
