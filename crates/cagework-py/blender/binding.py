"""What a bound mesh stores, and the shape key that follows the cage.

Spaces: *bind space* is world space at the time of the bind. `to_bind` maps the mesh's local space to bind space. The cage
is mapped to the mesh's local space and then by `to_bind`, so that moving mesh and cage together does not deform the mesh.
"""

import io
import json
from contextlib import contextmanager
from uuid import uuid4

import bpy
import cagework as cw
import numpy as np
from bpy.app.handlers import persistent
from cagework._sparse import csr_array

KEY = "Cagework"
# Whether *Make Cage* made an object. A property of objects.
MADE = "cagework_made"
# A property of objects. A driver reads the cage into it, so that Blender evaluates the cage wherever it evaluates the
# object: without it, a cage that is hidden in renders keeps its last pose there.
POSE = "cagework_pose"
# A matrix counts as singular if its determinant is at most this fraction of the cube of its largest entry.
MIN_DETERMINANT = 1e-12
# Distance by which two equal shapes of a cage may differ, as a fraction of their size. Above rounding.
SHAPE_TOLERANCE = 1e-5
# Largest move of points that stay in place, as a fraction of the largest rounded number: a few roundings of float32.
PLACE_TOLERANCE = 1e-6


# Property of a mesh in the panel, and of *Make Cage*.
VERTICES = {"name": "Vertices", "description": "Largest number of vertices of the cage", "default": 80, "min": 8, "max": 400}


class Binding(bpy.types.PropertyGroup):
    """Binding of a mesh to a cage. The mesh is bound if `stamp` is not empty."""

    cage: bpy.props.PointerProperty(
        type=bpy.types.Object, name="Cage", description="Closed mesh around the mesh", poll=lambda _, o: o.type == "MESH"
    )
    # The cage of the weights. `cage` is the one that the user chose since.
    bound_cage: bpy.props.PointerProperty(type=bpy.types.Object)
    # The object whose space the cage is mapped to, if several objects share the mesh.
    owner: bpy.props.PointerProperty(type=bpy.types.Object)
    vertices: bpy.props.IntProperty(**VERTICES)
    grid: bpy.props.IntProperty(
        name="Grid", description="Cells along the longest side of the cage", default=64, min=8, max=512
    )
    stamp: bpy.props.StringProperty()
    weights: bpy.props.StringProperty(subtype="BYTE_STRING")
    to_bind: bpy.props.StringProperty(subtype="BYTE_STRING")
    report: bpy.props.StringProperty()
    # Names of the shape keys of the last bake, one per line.
    baked: bpy.props.StringProperty()
    # Frames of the last bake. A count of 0: there is no bake.
    bake_first: bpy.props.IntProperty()
    bake_step: bpy.props.IntProperty(default=1)
    bake_count: bpy.props.IntProperty()
    # Poses of the cage in these frames, [bake_count, n_cage, 3] float32, bind space.
    bake_poses: bpy.props.StringProperty(subtype="BYTE_STRING")
    # `stamp` when baked, and the digest of the F-curves.
    bake_stamp: bpy.props.StringProperty()
    bake_curves: bpy.props.StringProperty()


class Weights:
    """Weights of a bound mesh, from an archive in the mesh.

    rows: [n_points, n_cage] float32; rest: [n_cage, 3] the cage with modifiers and shape keys when bound, bind space;
    cage_local: [n_cage_vertices, 3] the cage without modifiers, local space;
    frames, offsets: for points outside the cage, as in cagework.deform.
    """

    def __init__(self, archive):
        with np.load(io.BytesIO(archive), allow_pickle=False) as file:
            self.rows, self.rest, self.cage_local = file["rows"], file["rest"], file["cage_local"]
            frames = str(file["frames"])
            self.extra, self.puller, self.pulled = None, None, None
            if "offsets" in file:
                self.extra = {"frames": json.loads(frames), "offsets": entries(file["offsets"])}
                self.outside = file["offsets"].any(axis=1).nonzero()[0]
                offsets = entries(file["offsets"][self.outside])
                self.part = sparse(self.rows[self.outside]), {**self.extra, "offsets": offsets}
                self.rested = self.deformed(self.rest)

    def deformed(self, posed):
        """Positions of the points with offsets in a pose of the cage, bind space."""
        weights, extra = self.part
        return cw.deform(weights, posed, extra)

    def pull_of(self, points, triangles, cage, depsgraph, grid):
        """The puller of the mesh with these points and triangles, bind space. Prepares it once per bind and shape."""
        if self.pulled is None or not all(map(np.array_equal, self.pulled, (points, triangles))):
            solid = cw.Cage(self.rest, cage_faces(cage, depsgraph))
            self.puller = cw.Puller(points, triangles, solid, sparse(self.rows), report=self.extra, grid=grid)
            self.pulled = points, triangles
        return self.puller

    def displacements(self, posed, matrix):
        """Displacements [n_points, 3] of the points in a pose of the cage, times a matrix [3, 3] from bind space."""
        moved = self.rows @ ((posed - self.rest) @ matrix.T).astype(np.float32)
        if self.extra is not None:
            moved[self.outside] = (self.deformed(posed) - self.rested) @ matrix.T
        return moved


class Seen:
    """What the last update of a bound mesh has seen. None: no update yet.

    posed: [n_cage, 3], bind space; basis: [n_points, 3], float32, local space; matrix: [4, 4], local to world space;
    fault: why the mesh did not follow, a sentence; unbound: the n_points for which a new bind failed;
    outdated: frames in which the cage had another pose than in the bake.
    """

    def __init__(self):
        self.outdated = set()
        self.posed = self.basis = self.matrix = self.fault = self.unbound = None


WEIGHTS_CACHE: dict[str, Weights] = {}
# By the mesh's `session_uid`: copies of a mesh share their stamp.
SEEN: dict[int, Seen] = {}


def entries(matrix):
    """The offsets of a report from a dense matrix."""
    vertex, column = matrix.nonzero()
    values = matrix[vertex, column].tolist()
    return {"columns": matrix.shape[1], "vertex": vertex.tolist(), "column": column.tolist(), "value": values}


def dense(offsets, n_points):
    """The dense matrix of the offsets of a report."""
    matrix = np.zeros((n_points, offsets["columns"]), np.float32)
    matrix[offsets["vertex"], offsets["column"]] = offsets["value"]
    return matrix


def sparse(rows):
    n, m = rows.shape
    return csr_array((rows.ravel(), np.tile(np.arange(m, dtype=np.int32), n), np.arange(n + 1) * m), rows.shape)


def loaded(mesh):
    """Weights of a bound mesh, cached by its stamp."""
    stamp = mesh.cagework.stamp
    if stamp not in WEIGHTS_CACHE:
        used = {each.cagework.stamp for each in bpy.data.meshes}
        for old in WEIGHTS_CACHE.keys() - used:
            del WEIGHTS_CACHE[old]
        WEIGHTS_CACHE[stamp] = Weights(mesh.cagework.weights)
    return WEIGHTS_CACHE[stamp]


def seen(mesh):
    return SEEN.setdefault(mesh.session_uid, Seen())


def to_bind(mesh):
    """Matrix [4, 4] from the local space of a bound mesh to bind space."""
    return np.frombuffer(mesh.cagework.to_bind).reshape(4, 4)


def stored(points):
    """Positions [n, 3] of vertices or of the points of a shape key, in float32 as Blender stores them."""
    flat = np.empty(3 * len(points), np.float32)
    points.foreach_get("co", flat)
    return flat.reshape(-1, 3)


def coordinates(points):
    """Positions [n, 3] of vertices or of the points of a shape key."""
    return stored(points).astype(np.float64)


def transform(points, matrix):
    matrix = np.asarray(matrix, np.float64)
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def basis_points(mesh):
    """The points of a mesh without its shape keys."""
    return mesh.shape_keys.reference_key.points if mesh.shape_keys else mesh.vertices


def basis(mesh):
    """Local positions of a mesh without its shape keys."""
    return coordinates(basis_points(mesh))


def mixed(obj):
    """Local positions of an object with its shape keys, without modifiers."""
    keys = obj.data.shape_keys
    if not keys:
        return coordinates(obj.data.vertices)
    if obj.show_only_shape_key:
        return coordinates(obj.active_shape_key.points)
    points = basis(obj.data)
    for key in keys.key_blocks[1:]:
        if key.value and not key.mute:
            offsets = coordinates(key.points) - coordinates(key.relative_key.points)
            points += key.value * group_weights(obj, key.vertex_group) * offsets
    return points


def group_weights(obj, name):
    """Weights [n_points, 1] of a vertex group, or 1 if there is no such group."""
    group = obj.vertex_groups.get(name)
    if group is None:
        return 1.0
    weights = np.zeros((len(obj.data.vertices), 1))
    for vertex in obj.data.vertices:
        for part in vertex.groups:
            if part.group == group.index:
                weights[vertex.index] = part.weight
    return weights


@contextmanager
def evaluated_mesh(obj, depsgraph):
    """The mesh of an object with its modifiers and shape keys, also in edit mode."""
    evaluated = obj.evaluated_get(depsgraph)
    try:
        yield evaluated.to_mesh()
    finally:
        evaluated.to_mesh_clear()


def cage_points(cage, depsgraph):
    """World positions [n_cage, 3] of a cage with its modifiers and shape keys."""
    with evaluated_mesh(cage, depsgraph) as mesh:
        return transform(coordinates(mesh.vertices), evaluated_matrix(cage, depsgraph))


def cage_faces(cage, depsgraph):
    """Faces of a cage with its modifiers, a list of vertices each."""
    with evaluated_mesh(cage, depsgraph) as mesh:
        return [list(face.vertices) for face in mesh.polygons]


def singular(matrix):
    linear = matrix.to_3x3()
    return abs(linear.determinant()) <= MIN_DETERMINANT * max(abs(x) for row in linear for x in row) ** 3


def fixed(obj):
    """Why the mesh of an object cannot be bound, as a sentence, or None."""
    mesh = obj.data
    if mesh.library or mesh.override_library:
        return f"The mesh of {obj.name} is linked from another file: make it local to bind it"
    if singular(obj.matrix_world):
        return f"{obj.name} has a scale of zero: set another scale"
    if mesh.shape_keys and not mesh.shape_keys.use_relative:
        return f"The shape keys of {obj.name} are absolute: turn on Relative"
    return None


def cage_fault(mesh, scene):
    """Why the cage of a mesh cannot be used, as a sentence, or None."""
    cage = mesh.cagework.cage
    if cage is None or cage.name not in scene.objects or scene.objects[cage.name] != cage:
        return "The cage was deleted: undo that, choose another cage, or unbind"
    if len(cage.data.polygons) == 0 and cage.mode != "EDIT":
        return f"{cage.name} has no faces: choose a closed mesh"
    return None


def problem(obj, scene):
    """Why a bound mesh does not follow its cage, as a sentence, or None."""
    return misfit(obj, scene) or seen(obj.data).fault


def misfit(obj, scene):
    """Why a bound mesh cannot follow its cage, as a sentence, or None. Does not look at the shape of the cage."""
    mesh = obj.data
    if fault := fixed(obj) or cage_fault(mesh, scene) or other_cage(obj):
        return fault
    n = len(loaded(mesh).rows)
    if n != len(mesh.vertices):
        again = seen(mesh).fault if seen(mesh).unbound == len(mesh.vertices) else None
        return again or f"{obj.name} has {len(mesh.vertices)} vertices and was bound with {n}: rebind"
    if not mesh.shape_keys or KEY not in mesh.shape_keys.key_blocks:
        return f"The shape key {KEY} of {obj.name} was deleted: rebind"
    return None


def other_cage(obj):
    """Says that a bound mesh was bound to another cage than the chosen one, or returns None."""
    chosen, bound = obj.data.cagework.cage, obj.data.cagework.bound_cage
    if chosen == bound:
        return None
    return f"{obj.name} is not bound to {chosen.name} yet: bind" + (f", or choose {bound.name}" if bound else "")


def owners(scene):
    """Objects of a scene with bound meshes: for each mesh, its owner, or another object if the owner is not in the scene."""
    seen = {}
    for obj in scene.objects:
        if obj.type == "MESH" and obj.data.cagework.stamp:
            if obj.data not in seen or obj.data.cagework.owner == obj:
                seen[obj.data] = obj
    return list(seen.values())


class Job:
    """One bind of several objects. `solve` touches no data of Blender, so that it can run in a thread."""

    def __init__(self, objects, cage, depsgraph, grid, keep_rest=False):
        self.objects, self.cage, self.grid = objects, cage, grid
        self.rest, self.faces = cage_points(cage, depsgraph), cage_faces(cage, depsgraph)
        self.cage_local = mixed(cage)
        kept = [loaded(o.data) for o in objects if o.data.cagework.stamp and o.data.cagework.bound_cage == cage]
        kept = [old for old in kept if len(old.rest) == len(self.rest)]
        # A stored rest cage is in the bind space of its own mesh, so it is reused only if a single
        # object is bound.
        if keep_rest and kept and len(objects) == 1:
            self.rest, self.cage_local, self.to_bind = kept[0].rest, kept[0].cage_local, [to_bind(objects[0].data)]
        else:
            self.to_bind = [np.array(o.matrix_world, np.float64) for o in objects]
        self.points = [transform(basis(o.data), m) for o, m in zip(objects, self.to_bind)]
        self.results = None

    def solve(self, progress=None):
        cage = cw.Cage(self.rest, self.faces)
        if len(self.points) == 1:
            self.results = [cw.bind(self.points[0], cage, grid=self.grid, progress=progress)]
        else:
            self.results = cw.bind_many(self.points, cage, grid=self.grid, progress=progress)

    def store(self, depsgraph):
        for obj, matrix, (weights, report) in zip(self.objects, self.to_bind, self.results):
            mesh, parts = obj.data, {"rows": weights.toarray(), "rest": self.rest, "cage_local": self.cage_local}
            if report.get("offsets") is not None:
                parts["offsets"] = dense(report["offsets"], len(parts["rows"]))
            archive = io.BytesIO()
            np.savez(archive, frames=json.dumps(report["frames"]), **parts)
            bound = mesh.cagework
            bound.cage = bound.bound_cage = self.cage
            bound.owner, bound.grid, bound.stamp = obj, self.grid, uuid4().hex
            bound.weights, bound.to_bind, bound.report = archive.getvalue(), matrix.tobytes(), card(report)
            SEEN.pop(mesh.session_uid, None)
            live_key(obj)
            drive(mesh)
            follow(obj, depsgraph)


def card(report):
    """Formats the report of a bind in a few lines."""
    points, outside = report["vertices"], report["outside_vertices"]
    lines = [
        f"{points:,} points, {report['cage_vertices']:,} cage vertices, grid {report['grid']}",
        f"{report['timings_ms']['total'] / 1000:.2f} s, {report['memory_bytes']['peak'] / 2**20:.0f} MB",
        "All points are inside" if not outside else f"{outside:,} points are outside the cage",
        *report["notices"],
    ]
    return "\n".join(lines)


def live_key(obj):
    """Returns the shape key that follows the cage, and makes it if it is missing."""
    keys = obj.data.shape_keys
    if not keys:
        obj.shape_key_add(name="Basis", from_mix=False)
        keys = obj.data.shape_keys
    key = keys.key_blocks.get(KEY)
    if key is None:
        active = obj.active_shape_key_index
        key = obj.shape_key_add(name=KEY, from_mix=False)
        key.value = 1.0
        obj.active_shape_key_index = active
    return key


def drive(mesh):
    """Makes the objects of a mesh depend on transform, shape keys and modifiers of its cage, by a driver.

    A driver of the mesh would make Blender evaluate the mesh once more in each frame.
    """
    release(mesh)
    for obj in objects_of(mesh):
        driver = obj.driver_add(POSE).driver
        driver.type = "SUM"  # Unlike an expression, it needs no permission to run scripts.
        for kind in ["TRANSFORMS", "SINGLE_PROP"]:
            variable = driver.variables.new()
            variable.type, variable.targets[0].id = kind, mesh.cagework.cage
        variable.targets[0].data_path = "dimensions[0]"


def release(mesh):
    """Removes the drivers that `drive` adds."""
    for obj in objects_of(mesh):
        obj.driver_remove(POSE)


def objects_of(mesh):
    return [obj for obj in bpy.data.objects if obj.data == mesh]


def posed_cage(obj, depsgraph):
    """Returns the positions of the posed cage in the bind space of an object's mesh."""
    world = cage_points(obj.data.cagework.cage, depsgraph)
    return transform(world, to_bind(obj.data) @ np.linalg.inv(evaluated_matrix(obj, depsgraph)))


def evaluated_matrix(obj, depsgraph):
    return np.array(obj.evaluated_get(depsgraph).matrix_world, np.float64)


def reach(points, matrix):
    """Largest number in the products and sums that transform points, up to a factor of 3."""
    return np.abs(points).max() * np.abs(matrix[:3, :3]).max() + np.abs(matrix[:3, 3]).max()


def keep_place(obj, matrix, last):
    """Adapts `to_bind` after Apply Scale, Set Origin and the like. They change the local points and the matrix of an
    object, and keep its points in world space."""
    points = stored(basis_points(obj.data))
    if last.basis is not None and len(points) == len(last.basis) and not np.array_equal(points, last.basis):
        move = np.abs(transform(points, matrix) - transform(last.basis, last.matrix)).max()
        if move <= PLACE_TOLERANCE * max(reach(points, matrix), reach(last.basis, last.matrix)):
            change = np.linalg.inv(last.matrix) @ matrix
            obj.data.cagework.to_bind = (to_bind(obj.data) @ change).tobytes()
            last.posed = None
    last.basis, last.matrix = points, matrix


def follow(obj, depsgraph):
    """Writes the shape that the posed cage gives a bound mesh into its shape key. Returns a sentence if the cage does not fit."""
    weights, last = loaded(obj.data), seen(obj.data)
    keep_place(obj, evaluated_matrix(obj, depsgraph), last)
    posed = posed_cage(obj, depsgraph)
    if len(posed) != len(weights.rest):
        return f"The cage has {len(posed)} vertices and had {len(weights.rest)} when bound: undo that, or bind again"
    if last.posed is not None and np.array_equal(posed, last.posed):
        return None
    moved = weights.displacements(posed, np.linalg.inv(to_bind(obj.data)[:3, :3]))
    live_key(obj).points.foreach_set("co", (last.basis + moved).ravel())
    obj.data.shape_keys.update_tag()
    last.posed = posed
    return None


@persistent
def on_update(scene, depsgraph=None):
    """Handler: bound meshes follow their cages; a mesh whose topology changed is bound again."""
    if depsgraph is None:
        depsgraph = bpy.context.evaluated_depsgraph_get()
    for obj in owners(scene):
        mesh = obj.data
        if obj.mode == "EDIT" or fixed(obj) or cage_fault(mesh, scene) or other_cage(obj):
            continue
        n = len(mesh.vertices)
        if n and n != len(loaded(mesh).rows):
            if seen(mesh).unbound != n:
                rebind(obj, depsgraph)
        elif not misfit(obj, scene):
            seen(mesh).fault = follow(obj, depsgraph)
            if mesh.cagework.bake_count and not seen(mesh).fault:
                compare_bake(mesh, scene)


def compare_bake(mesh, scene):
    """Remembers whether the pose of the cage in the current frame differs from the baked one."""
    bound, last = mesh.cagework, seen(mesh)
    k, between = divmod(scene.frame_current - bound.bake_first, bound.bake_step)
    if between or scene.frame_subframe or not 0 <= k < bound.bake_count:
        return
    baked = np.frombuffer(bound.bake_poses, np.float32).reshape(bound.bake_count, -1, 3)[k]
    same = baked.shape == last.posed.shape and np.abs(baked - last.posed).max() <= SHAPE_TOLERANCE * np.ptp(last.posed)
    (last.outdated.discard if same else last.outdated.add)(scene.frame_current)


def rebind(obj, depsgraph):
    """Binds an edited mesh again to the rest shape of its cage. After a fault, it keeps the weights for an undo."""
    job = Job([obj], obj.data.cagework.cage, depsgraph, obj.data.cagework.grid, keep_rest=True)
    try:
        job.solve()
    except cw.Error as error:
        last = seen(obj.data)
        last.fault, last.unbound = f"{obj.name} was not bound again: {error}", len(obj.data.vertices)
        return
    job.store(depsgraph)


@persistent
def forget(*_):
    """Handler: after undo, redo or opening a file, forgets the last updates, so that the next one writes the shape keys."""
    SEEN.clear()
