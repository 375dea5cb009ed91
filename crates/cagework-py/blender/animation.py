"""Whether the cage of a bound mesh is animated, and whether a bake contains this animation."""

import hashlib

import bpy
import numpy as np

from . import binding

# Types of data that can animate a cage.
KINDS = {"ARMATURE", "CURVE", "KEY", "LATTICE", "MESH", "META", "NODETREE", "OBJECT", "TEXTURE"}
# Modifiers that change with time by themselves.
SIMULATIONS = {"BUILD", "CLOTH", "FLUID", "MESH_CACHE", "MESH_SEQUENCE_CACHE", "OCEAN", "SOFT_BODY", "WAVE"}
# Nodes that change with time by themselves.
TIME_NODES = {"GeometryNodeInputSceneTime", "GeometryNodeSimulationInput"}


def curve_groups(action):
    """The collections of F-curves of an action, in Blender 4 and 5."""
    if hasattr(action, "fcurves"):
        return [action.fcurves]
    return [bag.fcurves for layer in action.layers for strip in layer.strips for bag in strip.channelbags]


def curves(data):
    """The F-curves of animated data, including those of its NLA strips."""
    if not (animation := data.animation_data):
        return []
    actions = [strip.action for track in animation.nla_tracks if not track.mute for strip in track.strips]
    return [c for action in [animation.action, *actions] if action for group in curve_groups(action) for c in group]


def keyframes(curve):
    """Frames, values and handles [n, 6] of the keyframes of an F-curve."""
    found = []
    for part in ["co", "handle_left", "handle_right"]:
        flat = np.empty(2 * len(curve.keyframe_points), np.float32)
        curve.keyframe_points.foreach_get(part, flat)
        found.append(flat.reshape(-1, 2))
    return np.concatenate(found, axis=1)


def changes(data):
    """Whether an ID changes with time by its own animation, simulation or nodes."""
    if data.id_type == "OBJECT" and (data.rigid_body or any(m.type in SIMULATIONS for m in data.modifiers)):
        return True
    if data.id_type == "NODETREE" and any(node.bl_idname in TIME_NODES for node in data.nodes):
        return True
    drivers = data.animation_data.drivers if data.animation_data else []
    if any(each.driver.type == "SCRIPTED" and "frame" in each.driver.expression for each in drivers):
        return True
    return any(len(c.modifiers) or len(c.sampled_points) or is_curved(c) for c in curves(data))


def is_curved(curve):
    """Whether values or handles of keyframes differ."""
    return len(curve.keyframe_points) and np.ptp(keyframes(curve)[:, 1::2])


def line(obj):
    """An object and its parents."""
    found = []
    while obj:
        found.append(obj)
        obj = obj.parent
    return found


def sources(obj):
    """IDs whose animation moves the cage of a bound mesh relative to the mesh.

    The mesh and parents of both move both. An armature that is a parent of both can also deform the cage.
    """
    cage = obj.data.cagework.cage
    above, above_cage = line(obj), line(cage)
    shared = {o for o in above if o in above_cage and o.type != "ARMATURE"} | {obj}
    used = {}
    for data, users in bpy.data.user_map(key_types=KINDS, value_types=KINDS).items():
        for user in users:
            used.setdefault(user, set()).add(data)
    found, new = set(), {cage}
    while new:
        found |= new
        new = {each for data in new for each in used.get(data, ())} - found - shared
    return found | {o for o in above if o not in above_cage}


def digest(data):
    """Digest of the F-curves of IDs."""
    each = [b"".join(keyframes(c).tobytes() for c in curves(d)) for d in sorted(data, key=lambda d: (d.id_type, d.name))]
    return hashlib.sha256(b"".join(each)).hexdigest()


def form_of_bake(obj):
    """The form of the bake of a mesh, if its keys or its modifier still exist: "KEYS", "MDD", "PC2" or None."""
    names = obj.data.cagework.baked.split("\n")
    if names[0] and obj.data.shape_keys and all(name in obj.data.shape_keys.key_blocks for name in names):
        return "KEYS"
    return next((form for form in ["MDD", "PC2"] if f"Cagework {form}" in obj.modifiers), None)


def warning(obj, scene, exported=False):
    """Why other programs do not play the deformation of a bound mesh, as a sentence, or None.

    exported: as an exporter of shape keys writes it, so that a file for the Mesh Cache modifier does not count.
    """
    bound = obj.data.cagework
    if binding.misfit(obj, scene):
        return None
    animated = sources(obj)
    if not any(changes(data) for data in animated):
        return None
    cage, form = bound.cage.name, form_of_bake(obj)
    if form is None or (exported and form != "KEYS"):
        return (
            f"{cage} is animated, and {obj.name} has no {'baked shape keys' if exported else 'bake'}: it does not move "
            "in exported files and without this extension"
        )
    end = bound.bake_first + bound.bake_step * bound.bake_count
    if bound.bake_first > scene.frame_start or end <= scene.frame_end:
        return (
            f"The bake of {obj.name} has the frames {bound.bake_first} to {end - bound.bake_step}, and the scene "
            f"{scene.frame_start} to {scene.frame_end}: bake again"
        )
    if bound.bake_stamp != bound.stamp or bound.bake_curves != digest(animated) or binding.seen(obj.data).outdated:
        return f"{cage} was changed after the bake of {obj.name}: bake again"
    return None


def warnings(scene, exported=False):
    """The warnings of all bound meshes of a scene, by object."""
    found = {obj: warning(obj, scene, exported) for obj in binding.owners(scene)}
    return {obj: text for obj, text in found.items() if text}
