// Written by crates/cagework-web/src/border.rs from Rust's types. To change them, change those.

/**
 * Processor that computes a bind.
 */
export type Backend = "cpu" | "gpu";
/**
 * Options of a bind, and the processor that it runs on.
 */
export type BindOptions = {
/**
 * The processor.
 */
backend: Backend,
/**
 * Cells along the longest side of the cage's box, 8 to 512; with the classic method, along each side.
 * [`AUTO_GRID`] (0, or "auto" in JSON that is read) chooses the number for the cage. Default 0.
 */
grid: number,
/**
 * Discretisation of the cage. Default embedded.
 */
method: Method,
/**
 * Solver of Laplace's equation. Default multigrid.
 */
solver: Solver,
/**
 * Convergence threshold for delta: the mean change of a cell per Jacobi sweep, or the estimated remaining error
 * of the other solvers. Default 1e-5.
 */
tau: number,
/**
 * Limit on Jacobi sweeps, V-cycles, or steps of conjugate gradients. V-cycles also
 * stop at [`MAX_CYCLES`](crate::solve::stop::MAX_CYCLES). Default 20,000.
 */
max_iterations: number,
/**
 * Limit on the sum of the weights dropped from each row, smallest first. The row's sum and rest position are then
 * restored. 0 drops none. Default 0.
 */
sparsify: number,
/**
 * Limit on memory, bytes. A bind fails before it starts if its estimated memory and the caller's own data together
 * exceed this. Default 4 GiB; on the page and in the npm package 2 GiB.
 */
memory_limit: number,
/**
 * Treatment of vertices outside the cage. Default extend.
 */
outside: OutsidePolicy, };
/**
 * Options, grid, convergence, times and errors of a bind.
 */
export type BindReport = {
/**
 * Discretisation of the cage: classic (K. Smith; `docs/method.md`, sources) or embedded.
 */
method: Method,
/**
 * Solver of Laplace's equation: Jacobi, multigrid, or conjugate gradients.
 */
solver: Solver,
/**
 * Processor that computed the bind.
 */
backend: Backend,
/**
 * Name of the GPU, if it computed the solution.
 */
adapter?: string,
/**
 * Number of threads of the solver.
 */
threads: number,
/**
 * Number of cells along the longest side, as requested or chosen.
 */
grid: number,
/**
 * Explanation of a number that was chosen automatically.
 */
grid_reason?: string,
/**
 * Cells of the grid along x, y, z.
 */
dims: [number, number, number],
/**
 * Edge lengths of a cell, object units.
 */
cell_size: [number, number, number],
/**
 * Convergence threshold for delta, the last value of `delta_history`.
 */
tau: number,
/**
 * Cells of the finest grid by kind.
 */
cells: CellCounts,
/**
 * Number of unknowns of each level, finest first; one entry for Jacobi.
 */
levels: Array<number>,
/**
 * Jacobi sweeps, V-cycles on the finest level, or steps of conjugate gradients; maximum over batches.
 */
iterations: number,
/**
 * Whether delta fell to tau within the limit on iterations, or f32 precision was exhausted.
 */
converged: boolean,
/**
 * Whether f32 precision ended the solve before delta fell to tau.
 */
at_round_off: boolean,
/**
 * Delta after every `delta_interval` iterations. Jacobi: mean change of a cell per sweep (K. Smith, Eq. 2). Other
 * solvers: estimated remaining error, RMS over cells. `[iterations / delta_interval]`, rounded up.
 */
delta_history: Array<number>,
/**
 * Iterations per entry of `delta_history`: 1 except for Jacobi on the GPU.
 */
delta_interval: number,
/**
 * RMS residual of the finest level before each iteration; empty for Jacobi. `[iterations]`
 */
residual_history: Array<number>,
/**
 * Wall-clock time of the stages, milliseconds.
 */
timings_ms: Timings,
/**
 * Working memory of the bind: estimated and largest actual size, bytes.
 */
memory_bytes: MemoryBytes,
/**
 * Rest error: distance of `sum_i w_i c_i`, over all columns, from the mesh vertex.
 */
rest_error: RestError,
/**
 * Error of the rows of weights before they are corrected. With the embedded method, it is the error of the solver
 * alone. `None` if all rows have offsets, as around inner points and bones: their weights do not reproduce positions.
 */
raw_error: RawError | null,
/**
 * Range, largest sum error, and number of the stored weights.
 */
weights: WeightStats,
/**
 * Number of mesh vertices (rows).
 */
vertices: number,
/**
 * Number of cage vertices (the first columns).
 */
cage_vertices: number,
/**
 * Number of inner controls (the next columns).
 */
inner_controls: number,
/**
 * Subdivision steps of the smooth surface.
 */
smooth: number,
/**
 * Number of mesh vertices outside the cage.
 */
outside_vertices: number,
/**
 * Number of mesh vertices outside the cage that stay in place.
 */
staying_vertices: number,
/**
 * Largest distance between the cage and a mesh vertex outside it, object units.
 */
outside_distance: number,
/**
 * Number of mesh vertices inside the balls and tubes around inner points and bones.
 */
held_vertices: number,
/**
 * Number of cells for which lines along x, y and z disagree about inside and outside the cage.
 */
ambiguous_cells: number,
/**
 * Notices in whole sentences, for example about flipped faces or unused vertices.
 */
notices: Array<string>, };
/**
 * A humanoid bone. The names are those of VRM 1.0.
 */
export type Bone = "hips" | "spine" | "chest" | "upperChest" | "neck" | "head" | "leftShoulder" | "rightShoulder" | "leftUpperArm" | "rightUpperArm" | "leftLowerArm" | "rightLowerArm" | "leftHand" | "rightHand" | "leftUpperLeg" | "rightUpperLeg" | "leftLowerLeg" | "rightLowerLeg" | "leftFoot" | "rightFoot" | "leftToes" | "rightToes";
/**
 * What told which joint is which bone.
 */
export type BoneSource = "vrm" | "names" | "shape";
/**
 * A humanoid bone, as panels show it.
 */
export type BoneView = {
/**
 * Name of the bone.
 */
bone: Bone,
/**
 * Name of its joint, if it has one.
 */
joint: string | null,
/**
 * Whether the user has chosen the joint.
 */
given: boolean, };
/**
 * Weights as compressed sparse rows. `offsets` describes the columns after the columns of the controls.
 */
export type BoundArrays = {
/**
 * Start of each row. `[n_rows + 1]`
 */
indptr: Uint32Array,
/**
 * Column of each weight: controls first, then frames. `[n_nonzeros]`
 */
indices: Uint32Array,
/**
 * Weights that are not 0. `[n_nonzeros]`
 */
data: Float32Array, offsets: Offsets, };
/**
 * Axis-aligned bounding box, in object units.
 */
export type Bounds = {
/**
 * Corner with the smallest coordinates.
 */
min: [number, number, number],
/**
 * Corner with the largest coordinates.
 */
max: [number, number, number], };
/**
 * A built-in sample: model, cage and poses.
 */
export type BuiltSample = {
/**
 * The model as a GLB file.
 */
glb: Uint8Array,
/**
 * Vertices of the model. `[n_vertices, 3]`
 */
positions: Float32Array, cage: CageArrays, poses: Array<PoseArrays>,
/**
 * Point of the model that the page asks the user to pull first, object units.
 */
grip: [number, number, number], };
/**
 * A cage as arrays, and what its generator says about it.
 */
export type CageArrays = {
/**
 * Cage vertices, then controls inside the cage. `[n_controls, 3]`
 */
positions: Float32Array,
/**
 * For each face, the number of its corners and then their vertices.
 */
corners: Uint32Array,
/**
 * Subdivision and inner controls. Undefined for a new cage. The document then keeps its inner controls, as
 * far as they fit into the new cage.
 */
controls?: CageControls | undefined,
/**
 * Number of separate parts of the model that a generated cage joins; 0 if it joins none.
 */
bridged?: number,
/**
 * Sentences about gaps of the model that a generated cage closes, with settings that would keep the gaps open.
 */
notices?: Array<string>,
/**
 * Kind of a generated cage: skeleton, shell or hull.
 */
kind?: CageKind,
/**
 * Why a generated cage of the kind auto has no rings along the skeleton, one sentence.
 */
refusal?: string,
/**
 * Rings of a generated cage of the kind skeleton.
 */
rings?: Rings, };
/**
 * Subdivision and inner controls of a cage.
 */
export type CageControls = {
/**
 * Number of subdivision steps from the cage to its smooth surface.
 */
smooth: number,
/**
 * Number of inner controls, which are the last of the cage's positions.
 */
inner: number,
/**
 * Points, lines and faces; indices are relative to the first inner control.
 */
elements: Array<InnerElement>,
/**
 * Radius of points and lines, object units; null for 1/32 of the cage's longest side.
 */
radius: number | null,
/**
 * Loops of cage vertices around limbs, of a generated cage.
 */
rings?: Array<Array<number>>, };
/**
 * Counts, bounds and notices of the cage.
 */
export type CageInfo = { vertices: number, edges: number, faces: number,
/**
 * Number of quads among the faces.
 */
quads: number, bounds: Bounds, notices: Array<string>, };
/**
 * Kind of a generated cage.
 */
export type CageKind = "auto" | "skeleton" | "shell" | "hull";
/**
 * Options of [`super::generate`].
 */
export type CageOptions = {
/**
 * Target number of vertices, 8 to 400. Default 80.
 */
target: number,
/**
 * Allowed RMS distance of the cage from the shape that it follows, as a fraction of the model's longest side,
 * 0.005 to 0.2. Simple shapes get fewer vertices than the target. Default 0.028, about one voxel of the first
 * lattice for the default target, which has 36 voxels along the longest side.
 */
detail: number,
/**
 * Whether to pair triangles into quads. Default true.
 */
quads: boolean,
/**
 * Kind of cage. Default auto.
 */
kind: CageKind,
/**
 * Mirror symmetry. Default auto.
 */
symmetry: Symmetry,
/**
 * Whether each part of the model gets its own closed cage (parts within a few voxels of each other count as one).
 * Otherwise thin bridges join them into one cage. Default false.
 */
per_component: boolean,
/**
 * Smallest allowed Chebyshev distance (largest distance along an axis) of the cage from the model, as a fraction
 * of the diagonal of the model's box, 0 to 0.25; at least half a voxel. Default 0.
 */
clearance: number,
/**
 * Voxels along the model's longest side, 8 to 128, or 0 to derive them from the target. Gaps narrower than three
 * voxels are closed, and details thinner than one voxel are lost. Default 0.
 */
voxels: number, };
/**
 * The cage's properties, and its inner controls.
 */
export type CageState = {
/**
 * Whether the cage is valid; otherwise it is a draft.
 */
usable: boolean, info: CageInfo, controls: CageControls,
/**
 * Radius of interior point and line controls, object units.
 */
radius: number, };
/**
 * Position, direction and projection of a camera, as links contain them.
 */
export type CameraView = {
/**
 * Point that the camera orbits, object units.
 */
target: [number, number, number],
/**
 * Rotation of the camera about y, radians; `pitch` is its elevation above the horizon.
 */
yaw: number, pitch: number,
/**
 * Distance from the eye to the target, object units.
 */
distance: number, parallel: boolean, };
/**
 * Numbers of cells by kind.
 */
export type CellCounts = {
/**
 * Cells inside the cage, without the boundary cells.
 */
interior: number,
/**
 * Classic method: cells that the cage's surface intersects. Embedded method: cells whose centre is inside the cage
 * and less than a cell from its surface along an axis.
 */
boundary: number,
/**
 * Cells outside the cage.
 */
exterior: number, };
/**
 * Kinds of problems of a cage. Scripts read these names in JSON reports: never rename a variant.
 */
export type Code = "empty" | "not_finite" | "bad_index" | "degenerate_face" | "duplicate_face" | "duplicate_vertex" | "t_junction" | "open_edge" | "non_manifold_edge" | "non_manifold_vertex" | "flipped" | "one_sided" | "self_intersection" | "unused_vertex" | "model_outside" | "thin_part" | "not_a_cage";
/**
 * Colour map that a legend shows.
 */
export type ColorMap = "viridis" | "error" | "kinds";
/**
 * What the colours of the model show: its materials, plain clay, weights, or errors.
 */
export type Colour = "material" | "clay" | "weight" | "error";
/**
 * A change of the document.
 */
export type Command = { "do": "set_pose",
/**
 * Positions of cage vertices, then of inner controls, object units. `[n_controls]`
 */
positions: readonly (readonly [number, number, number])[], } | { "do": "reset_pose" } | { "do": "set_proportion",
/**
 * Name of the proportion, such as "leg" for both sides or "left_leg" for one.
 */
name: string,
/**
 * Factor, 0.5 to 2; 1 keeps the length at rest.
 */
factor: number, } | { "do": "set_preset",
/**
 * Name of the preset; null sets all factors to 1.
 */
name: string | null, } | { "do": "mirror_proportions" } | { "do": "set_bone",
/**
 * Name of the bone.
 */
bone: Bone,
/**
 * Name of the joint; null takes the joint that the file's data, names or shape tell.
 */
joint: string | null, } | { "do": "save_pose",
/**
 * Name of the new saved pose.
 */
name: string, } | { "do": "apply_pose",
/**
 * Index of the pose in the list of saved poses.
 */
index: number, } | { "do": "rename_pose",
/**
 * Index of the pose in the list of saved poses.
 */
index: number,
/**
 * New name of the pose.
 */
name: string, } | { "do": "remove_pose",
/**
 * Index of the pose in the list of saved poses.
 */
index: number, } | { "do": "update_pose",
/**
 * Index of the pose in the list of saved poses.
 */
index: number, } | { "do": "duplicate_pose",
/**
 * Index of the pose in the list of saved poses.
 */
index: number,
/**
 * Name of the copy.
 */
name: string, } | { "do": "move_pose",
/**
 * Index of the pose in the list of saved poses.
 */
index: number,
/**
 * New index of the pose in the list.
 */
to: number, } | { "do": "set_pose_time",
/**
 * Index of the pose in the list of saved poses.
 */
index: number,
/**
 * Seconds since the start of the animation.
 */
seconds: number, } | { "do": "set_pose_interpolation",
/**
 * Index of the pose in the list of saved poses.
 */
index: number,
/**
 * The interpolation; null uses that of the whole animation.
 */
interpolation: Interpolation | null, } | { "do": "set_transition",
/**
 * Interpolation between the poses, and how the animation ends.
 */
transition: Transition, } | { "do": "blend",
/**
 * Index of the pose in the list of saved poses.
 */
index: number,
/**
 * New share of the pose, 0 to 1.
 */
share: number, } | { "do": "carry_poses",
/**
 * Identifier of the other cage, as the view of a document gives it.
 */
from: number,
/**
 * Positions of the controls of this cage, concatenated over the poses. `[n_poses, n_controls]`
 */
positions: readonly (readonly [number, number, number])[],
/**
 * Shares of the saved poses in the current pose.
 */
shares: Array<number>, } | { "do": "set_pins",
/**
 * Points on the surfaces of the models.
 */
pins: Array<SurfacePoint>, } | { "do": "replace_cage",
/**
 * Positions of the vertices of the new cage, then of its inner controls, and the cage's faces.
 */
mesh: unknown,
/**
 * Subdivision and inner controls; null keeps the current ones if they fit.
 */
controls: CageControls | null,
/**
 * Notices of the cage generator about the new cage.
 */
notices: Array<string>,
/**
 * Loops of vertices around the limbs of a generated cage.
 */
rings?: Array<Array<number>>, } | { "do": "move_rest" } | { "do": "edit_rest",
/**
 * What to do with the selected elements.
 */
edit: RestEdit, } | { "do": "subdivide",
/**
 * Number of subdivision steps, 0 to 3.
 */
steps: number, } | { "do": "set_radius",
/**
 * Radius, object units; null for 1/32 of the cage's longest side.
 */
radius: number | null, } | { "do": "add_control",
/**
 * A point, a polyline through `places`, or a sheet with corners at `places`.
 */
kind: InnerKind,
/**
 * Positions of the corners of the new element, object units.
 */
places: readonly (readonly [number, number, number])[], } | { "do": "add_sheet",
/**
 * Centre of the sheet, object units.
 */
center: readonly [number, number, number],
/**
 * Half axes of the sheet before it is shrunk: the largest size that is tried is 4/5 of these axes.
 */
axes: readonly (readonly [number, number, number])[], } | { "do": "replace_controls",
/**
 * Positions of the new controls, object units. `[n_inner]`
 */
positions: readonly (readonly [number, number, number])[],
/**
 * Points, lines and faces; indices are relative to `positions`.
 */
elements: Array<InnerElement>, } | { "do": "remove_model",
/**
 * Identifier of the model in the document.
 */
id: number, } | { "do": "set_parts",
/**
 * Identifier of the model in the document.
 */
id: number,
/**
 * Visibility, and names of the parts that are rigid or stay in place.
 */
options: PartOptions, } | { "do": "set_painted",
/**
 * Identifier of the model in the document.
 */
id: number,
/**
 * Amounts, 0 (moves with the cage) to 255 (stays in place). `[n_vertices]`, or empty for an unpainted model
 */
amounts: Array<number>, };
/**
 * Kind of coordinates.
 */
export type Coordinates = "harmonic" | "mean_value" | "green";
/**
 * Options of a drag.
 */
export type DragOptions = {
/**
 * Distance along the surface up to which the model moves.
 */
reach: Reach,
/**
 * Share by which parts within the reach return to their rest shape as the drag grows, 0 to 1. Default 0.5.
 */
relax: number,
/**
 * Whether the cage stays symmetric: each step averages it with its mirror image. Default false.
 */
symmetry: boolean, };
/**
 * Element type that a click selects.
 */
export type Element = "vertex" | "edge" | "face";
/**
 * Kinds of errors that the page handles differently.
 */
export type ErrorName = "Cancelled" | "Format" | "TooLarge" | "Memory" | "WeightsMemory" | "Outside" | "NoneInside" | "NoAdapter" | "NoDevice" | "DeviceLost" | "Gpu" | "Canvas" | "Missing" | "Error";
/**
 * What happens to planted feet in clips.
 */
export type Feet = "free" | "lock";
/**
 * A remedy for a problem.
 */
export type Fix = { "kind": "repair",
/**
 * The repair to apply.
 */
repair: Repair, } | { "kind": "grid",
/**
 * Number of cells that resolves all parts of the cage.
 */
cells: number, };
/**
 * A humanoid in its cage, and a part of its bind.
 */
export type FoldArrays = {
/**
 * Cage vertices and inner controls at rest. `[n_controls, 3]`
 */
rest: Float32Array,
/**
 * Loops of cage vertices around limbs.
 */
rings: Array<Array<number>>, rig: RigArrays,
/**
 * Bones and the names of their joints.
 */
bones: Array<[string, string]>,
/**
 * Points at rest that the influences of the rig belong to. `[n_points, 3]`
 */
points: Float32Array,
/**
 * Weights of some vertices.
 */
weights: BoundArrays,
/**
 * These vertices at rest. `[n_vertices, 3]`
 */
positions: Float32Array,
/**
 * Triangles of these vertices. `[n_triangles, 3]`
 */
triangles: Uint32Array, };
/**
 * Columns of a bind's weights that follow those of its controls.
 */
export type Frames = {
/**
 * Contribution of each cage vertex to the matrix of the whole cage's motion, per object unit; empty without
 * frames. `[n_cage]`
 */
whole: Array<[number, number, number]>,
/**
 * The control of each joint. `[n_joints]`
 */
joints: Array<number>,
/**
 * The two joints of each bone, as indices into `joints`; bones of a line are consecutive. `[n_bones]`
 */
bones: Array<[number, number]>,
/**
 * Weights of the cage vertices at each joint in the cage without inner controls, and their gradients (per object
 * unit). `[n_joints, n_cage]`
 */
plain: Array<[number, number, number, number]>, };
/**
 * Transformation that a gesture applies to the selection.
 */
export type Gesture = "grab" | "rotate" | "scale";
/**
 * Kind, amount and constraint of a gesture, for a status line.
 */
export type GestureView = {
/**
 * Whether the gesture translates, rotates or scales, which determines the unit of `amounts`.
 */
kind: Gesture,
/**
 * Movement along the axis or along x, y and z, object units; the angle in degrees; or the factor.
 */
amounts: Array<number>,
/**
 * Axis of the constraint, 0 to 2; null if the gesture is free.
 */
axis: number | null,
/**
 * Whether the gesture is restricted to the plane normal to `axis`.
 */
plane: boolean, };
/**
 * Operation of a gizmo, with the shape of its handles.
 */
export type GizmoMode = "move" | "rotate" | "scale";
/**
 * A handle of a gizmo.
 */
export type GizmoPart = { "axis": number } | { "plane": number } | "view";
/**
 * Start of a pull.
 */
export type GrabInput = {
/**
 * Current pose of the cage and of the controls inside it. `[n_controls, 3]`
 */
start: Float32Array,
/**
 * Weights of the grabbed points, then of the pinned points. `[n_grabs + n_pins, n_columns]`
 */
rows: Float64Array,
/**
 * For each row of `rows`, the model vertex nearest to the point; 2^32 - 1 if the point is a cage vertex.
 * `[n_grabs + n_pins]`
 */
seeds: Uint32Array,
/**
 * Frames of the bind that the weights come from.
 */
frames: Frames,
/**
 * Number of grabbed points.
 */
grabs: number, options: Partial<DragOptions>, };
/**
 * Result of starting a pull: the grabbed points, and which part of the model the pull moves.
 */
export type GrabResult = {
/**
 * Positions of the grabbed points in the pose `start`. `[n_grabs, 3]`
 */
place: Float32Array,
/**
 * How strongly the pull keeps each model vertex in place, 0 to 1. `[n_vertices]`
 */
stays: Float32Array,
/**
 * Distance along the surface within which the pull moves the model, as a fraction of the model's size. Infinite if
 * the pull moves the whole model.
 */
reach: number, };
/**
 * Humanoid bones of the models, for panels.
 */
export type HumanoidInfo = {
/**
 * What told which joint is which bone; null if the skeleton is not that of a humanoid.
 */
source: BoneSource | null,
/**
 * Why the skeleton is not that of a humanoid, one sentence.
 */
fault: string | null,
/**
 * Bones in the order of [`Bone`]. Without a source, only the missing bones and those that the user has given.
 */
bones: Array<BoneView>,
/**
 * Distinct names of the joints.
 */
joints: Array<string>, };
/**
 * An element of inner controls: indices into [`InnerControls::positions`].
 */
export type InnerElement = { "point": number } | { "line": Array<number> } | { "face": Array<number> };
/**
 * A kind of inner control.
 */
export type InnerKind = "point" | "line" | "face";
/**
 * Interpolation between two keys, as in glTF 2.0, appendix C.
 */
export type Interpolation = "step" | "linear" | "cubic";
/**
 * How the skeleton follows the cage.
 */
export type Joints = "follow" | "stay" | "turn";
/**
 * The largest weight, and the index of the model vertex that has it.
 */
export type LargestWeight = { value: number, vertex: number, };
/**
 * Legend of the colours of the slice or the model.
 */
export type Legend = { low: number, high: number, logarithmic: boolean, map: ColorMap,
/**
 * Largest of the displayed weights; null for other quantities.
 */
largest: LargestWeight | null, };
/**
 * Mean and maximum of an error over the mesh vertices inside the cage.
 */
export type MeanMax = {
/**
 * Mean of the error.
 */
mean: number,
/**
 * Largest error of a vertex.
 */
max: number, };
/**
 * Properties and options of one of the models in the cage.
 */
export type MemberInfo = {
/**
 * Identifier, which stays the same for the model's lifetime.
 */
id: number, name: string, format: ModelFormat, vertices: number, triangles: number,
/**
 * Number of joints of its skins.
 */
joints: number,
/**
 * Names of the parts, prefixed by their kind, such as `material:Cloth`.
 */
parts: Array<string>, options: PartOptions,
/**
 * Whether some vertices of the model are painted to stay in place.
 */
painted: boolean, };
/**
 * Working memory of a bind, bytes.
 */
export type MemoryBytes = {
/**
 * Estimate that is compared with the memory limit before the bind starts.
 */
estimated: number,
/**
 * Largest sum of buffers alive at the same time.
 */
peak: number, };
/**
 * Discretisation of the cage.
 */
export type Method = "classic" | "embedded";
/**
 * File format of a model.
 */
export type ModelFormat = "gltf" | "fbx" | "obj" | "ply" | "stl" | "off" | "3mf" | "splat" | "spz" | "sog";
/**
 * Combined properties of all models in the cage.
 */
export type ModelInfo = {
/**
 * Name of the first model.
 */
name: string, format: ModelFormat, up: UpAxis, vertices: number, triangles: number, faces: number, materials: number, textures: number,
/**
 * Number of splats of a capture, otherwise 0.
 */
splats: number,
/**
 * Number of points of a point cloud, otherwise 0.
 */
points: number, skins: number, joints: number, clips: Array<SharedClip>,
/**
 * Morph targets of all models, and their weights at rest.
 */
targets: Array<TargetView>,
/**
 * Names of unskinned parts attached to joints or animated nodes, which an export can keep rigid.
 */
props: Array<string>,
/**
 * Whether a model has a rig that an export keeps.
 */
rigged: boolean,
/**
 * Whether a model is a VRM.
 */
vrm: boolean, bounds: Bounds,
/**
 * Another up axis that the file probably has: z for a 3MF file and for a mesh that seems to lie on its back. Null if
 * there is none, if the up axis is not y, and for captures, which are turned when they are opened.
 */
suggestedUp: UpAxis | null, notices: Array<string>,
/**
 * Properties of each model.
 */
members: Array<MemberInfo>, };
/**
 * Frames of a bind, and the points outside the cage.
 */
export type Offsets = {
/**
 * Local coordinate frames that carry the part of each position that the weights of the controls do not reproduce.
 * In the weights, their columns follow the columns of the controls.
 */
frames: Frames,
/**
 * Points outside the cage.
 */
outside: Array<OutsideVertex>, };
/**
 * Contents that the page opens together with models.
 */
export type OpenContents = {
/**
 * Identifier of the built-in sample; null for other models.
 */
sample: string | null,
/**
 * JSON of the page's settings in a project.
 */
settings: string | null, cage: CageArrays | null,
/**
 * Poses of a sample. The poses of a project are in its `LoadedModel`.
 */
poses: Array<PoseArrays>, };
/**
 * Treatment of mesh vertices outside the cage.
 */
export type OutsidePolicy = "extend" | "stay" | "refuse";
/**
 * A mesh vertex outside the cage.
 */
export type OutsideVertex = {
/**
 * Index of the mesh vertex.
 */
vertex: number,
/**
 * Distance from the cage, object units.
 */
distance: number,
/**
 * Share of the cage's motion that the vertex follows: 1 near the cage, 0 if the vertex stays in place.
 */
share: number, };
/**
 * Visibility of a model, and which of its parts the cage does not bend.
 */
export type PartOptions = {
/**
 * Whether the model is drawn and can be picked.
 */
shown: boolean,
/**
 * Names of parts that keep their shape; "all" for the whole model.
 */
rigid: Array<string>,
/**
 * Names of parts that stay in place; "all" for the whole model.
 */
stays: Array<string>, };
/**
 * Centre of rotation and scaling.
 */
export type Pivot = "middle" | "border" | "last";
/**
 * Locations of a problem: indices into the checked mesh, and points in object units.
 */
export type Places = {
/**
 * Cage vertices; for [`Code::ModelOutside`] vertices of the model.
 */
vertices: Array<number>,
/**
 * Pairs of cage vertices.
 */
edges: Array<[number, number]>,
/**
 * Cage faces.
 */
faces: Array<number>,
/**
 * Points in space, object units.
 */
points: Array<[number, number, number]>, };
/**
 * A saved pose of the cage and the name that the list of poses shows.
 */
export type PoseArrays = { name: string,
/**
 * Positions of the cage's vertices and inner controls. `[n_controls, 3]`
 */
positions: Float32Array, };
/**
 * A saved pose, as panels show it.
 */
export type PoseView = {
/**
 * Name of the pose, as lists show it.
 */
name: string,
/**
 * Whether the pose was saved for the current cage.
 */
fits: boolean,
/**
 * Time in the animation, seconds; 0 if `fits` is false.
 */
seconds: number,
/**
 * Interpolation from the previous pose to this one; null uses that of the transition.
 */
interpolation: Interpolation | null,
/**
 * Hash of the positions, by which the page finds the pose's picture.
 */
hash: number, };
/**
 * All occurrences of one kind of problem.
 */
export type Problem = {
/**
 * Kind of the problem.
 */
code: Code,
/**
 * Whether the problem prevents binding, may spoil the results, or is harmless.
 */
severity: Severity,
/**
 * Number of occurrences, including those that `places` does not list.
 */
count: number,
/**
 * Locations of the occurrences; each of the four lists has at most [`MAX_PLACES`] entries.
 */
places: Places,
/**
 * Description, one sentence.
 */
message: string,
/**
 * Remedies, best first; empty if the user has to decide.
 */
fixes: Array<Fix>, };
/**
 * Progress of a bind or of cage generation, passed to [`Progress::report`].
 */
export type Progress = {
/**
 * Stage that is in progress.
 */
stage: Stage,
/**
 * Completed share of the whole work, 0 to 1.
 */
fraction: number,
/**
 * Number of iterations of the solver in this stage: sweeps, V-cycles or steps.
 */
iteration: number,
/**
 * Latest delta of the solver, which it compares with its tolerance ([`crate::solve::stop`]); `None` if the stage
 * has none.
 */
delta: number | null, };
/**
 * A proportion of a humanoid.
 */
export type Proportion = "leg" | "arm" | "torso" | "neck" | "head" | "hand" | "foot" | "shoulder" | "hip" | "limb" | "waist" | "height";
/**
 * Factors of a proportion between which the surface of the model does not fold.
 */
export type ProportionRange = {
/**
 * The proportion.
 */
proportion: Proportion,
/**
 * Least factor.
 */
min: number,
/**
 * Greatest factor.
 */
max: number, };
/**
 * What `proportions` of the npm package takes beside model and cage.
 */
export type ProportionsRequest = {
/**
 * Factors by the names of the proportions.
 */
factors: { [key in string]: number },
/**
 * Name of a preset whose other factors apply.
 */
preset: string | null,
/**
 * Joints of humanoid bones that are not found, by the names of the bones in VRM 1.0.
 */
bones: { [key in string]: string }, };
/**
 * One frame of a pull.
 */
export type PullFrame = {
/**
 * Pose of the cage. `[n_controls, 3]`
 */
cage: Float32Array,
/**
 * True once further frames would not change the pose.
 */
settled: boolean,
/**
 * Largest distance of a grabbed or pinned point from its target, as a fraction of the model's size.
 */
error: number, };
/**
 * Error of the rows before correction, over vertices inside the cage. Operator and sampling reproduce linear functions
 * exactly, so with the embedded method this error is that of the solver.
 */
export type RawError = {
/**
 * Deviation of a row's sum from 1: `|sum_i w_i - 1|`.
 */
sum: MeanMax,
/**
 * Distance of `sum_i w_i c_i` from the vertex, as a fraction of the diagonal of the cage's bounding box.
 */
point_rel: MeanMax,
/**
 * Smallest weight, before negative weights are set to 0.
 */
min_weight: number, };
/**
 * Distance along the surface, from the grabs, up to which a drag moves the model.
 */
export type Reach = "automatic" | { "of": number } | "whole";
/**
 * A repair of a cage mesh that needs no decision by the user.
 */
export type Repair = "weld" | "drop_degenerate" | "mirror" | "fill_holes" | "flip" | "grow";
/**
 * An edit of the selected elements of the cage.
 */
export type RestEdit = "split_edge" | "collapse_edge" | "extrude_face" | "delete_vertex" | "delete_face";
/**
 * Reconstruction error of the rest pose: distance of `sum_i w_i c_i` from the mesh vertex. The mean is Eq. 3 in
 * K. Smith's paper (`docs/method.md`, sources).
 */
export type RestError = {
/**
 * Mean over the vertices, object units.
 */
mean: number,
/**
 * 99th percentile over the vertices, object units.
 */
p99: number,
/**
 * Largest error of a vertex, object units.
 */
max: number,
/**
 * Mean over the vertices, as a fraction of the diagonal of the cage's bounding box.
 */
mean_rel: number,
/**
 * Largest error of a vertex, as a fraction of the diagonal of the cage's bounding box.
 */
max_rel: number, };
/**
 * Joints of a model at rest, and their influences on its vertices.
 */
export type RigArrays = { names: Array<string>,
/**
 * Index of the parent of each joint; -1 for a root. `[n_joints]`
 */
parents: Array<number>,
/**
 * Positions of the joints, object units. `[n_joints, 3]`
 */
positions: Float32Array,
/**
 * Start of each vertex's influences in `joints` and `weights`. `[n_vertices + 1]`
 */
first: Uint32Array,
/**
 * Joint of each influence.
 */
joints: Uint32Array,
/**
 * Weight of each influence.
 */
weights: Float32Array, };
/**
 * How an export treats the rig of a model.
 */
export type RigOptions = {
/**
 * Whether to export only the shape, without the rig.
 */
plain: boolean,
/**
 * Whether the cage deforms the model after a clip has moved it.
 */
dynamic: boolean,
/**
 * Whether the user has switched `ground` off, so that changed proportions do not switch it on.
 */
ground_off: boolean,
/**
 * How the skeleton follows the cage.
 */
joints: Joints,
/**
 * Whether translations of clips stay unchanged. Otherwise they scale with the height of the hips.
 */
keep_travel: boolean,
/**
 * Names of nodes with unskinned meshes that stay rigid, such as buckles, eyes and weapons.
 */
rigid: Array<string>,
/**
 * Whether the lowest points of the shape at rest and in each clip keep their heights.
 */
ground: boolean,
/**
 * What happens to planted feet in clips.
 */
feet: Feet,
/**
 * Whether each pose becomes an expression of a VRM. The poses then get a clip only if `timeline` is set.
 */
expressions: boolean, };
/**
 * Place of a cage vertex in a ring.
 */
export type RingPlace = {
/**
 * Index of the chain in [`Rings::chains`].
 */
chain: number,
/**
 * Number of the ring along the chain, from 0 at the ring nearest to the parent.
 */
ring: number,
/**
 * Number of the vertex in the ring, in order around it.
 */
place: number, };
/**
 * Rings of a cage of sleeves: a ring is a closed loop of vertices around a chain of the skeleton.
 */
export type Rings = {
/**
 * Names of the chains; the first is the trunk.
 */
chains: Array<string>,
/**
 * Place of each vertex of the cage. `[n_cage]`
 */
places: Array<RingPlace>, };
/**
 * Elements of the scene that are drawn, and their colours.
 */
export type SceneOptions = { model: boolean, cage: boolean, original: boolean, colour: Colour, slice: SliceContent,
/**
 * What dragging a handle of the gizmo does to the selection. Null hides the gizmo.
 */
gizmo: GizmoMode | null,
/**
 * Whether dragging pulls the model's surface. The cage is then drawn faintly.
 */
pull: boolean,
/**
 * Kinds of coordinates shown side by side, from the left. Kinds that are not computed yet are skipped.
 */
compare: Array<Coordinates>, problems: boolean,
/**
 * How the next export treats joints, which determines where the joints are marked. Null hides the marks.
 */
joints: Joints | null,
/**
 * Whether exports keep the models on their ground, so that the floor is drawn below the posed models.
 */
ground: boolean,
/**
 * Colours of background and overlays.
 */
theme: Theme,
/**
 * Whether the rest pose is drawn as a wireframe, as in figures 2 to 5 of K. Smith's paper (`docs/method.md`,
 * sources).
 */
base_wireframe: boolean,
/**
 * Whether the floor grid is drawn.
 */
floor: boolean,
/**
 * Whether splats outside the cage are drawn.
 */
floaters: boolean,
/**
 * Whether colours of weights span 0 to 1 instead of 0 to the maximum.
 */
weights_to_one: boolean, };
/**
 * How a set of vertices changes the selection.
 */
export type SelectMode = "replace" | "add" | "remove" | "toggle";
/**
 * The selected vertices, as panels show them.
 */
export type SelectionView = {
/**
 * Number of selected vertices.
 */
count: number,
/**
 * The vertex that was selected last.
 */
last: number | null,
/**
 * Centre of the selection, object units; null without a selection and during a gesture.
 */
center: [number, number, number] | null, };
/**
 * Settings of a project, with all values valid.
 */
export type Settings = { bind?: BindOptions, cage?: CageOptions, rig?: RigOptions, symmetry?: boolean,
/**
 * Notices about values that were replaced by defaults, one sentence each.
 */
notices: Array<string>, };
/**
 * Effect of a problem on binding and its results.
 */
export type Severity = "error" | "warning" | "note";
/**
 * Clips with the same name, of all models that have one.
 */
export type SharedClip = {
/**
 * Name of the clip, or its number if it has no name.
 */
name: string,
/**
 * Duration of the longest of these clips, seconds.
 */
seconds: number, };
/**
 * What the slice through the grid shows: nothing, the types of the cells, or the weights of a control.
 */
export type SliceContent = "off" | "kinds" | "value";
/**
 * Solver of Laplace's equation.
 */
export type Solver = "jacobi" | "multigrid" | "cg";
/**
 * Stages of a bind, in order, and of cage generation.
 */
export type Stage = "voxelize" | "solve" | "sample" | "simplify";
/**
 * A point on the surface of the models.
 */
export type SurfacePoint = {
/**
 * Number of the triangle, unique among all models that the document has ever contained.
 */
triangle: number,
/**
 * Barycentric coordinates in the triangle.
 */
bary: [number, number, number], };
/**
 * Mirror symmetry of the cage about a plane through the centre of the model's box.
 */
export type Symmetry = "auto" | "none" | "x" | "y" | "z";
/**
 * A morph target and its default weight.
 */
export type TargetView = { name: string, default: number, };
/**
 * Colours of background and overlays.
 */
export type Theme = "dark" | "light";
/**
 * Wall-clock time of each stage of a bind, milliseconds.
 */
export type Timings = {
/**
 * Voxelization, levels and transfer tables.
 */
voxelize: number,
/**
 * Solve of all columns.
 */
solve: number,
/**
 * Sampling and assembly.
 */
sample: number,
/**
 * The whole bind.
 */
total: number, };
/**
 * How clicks and gestures act on the cage.
 */
export type Tools = {
/**
 * Element type that a click selects.
 */
element: Element,
/**
 * Whether gestures also move the mirror images of the selected vertices.
 */
symmetry: boolean,
/**
 * Centre of rotation and scaling.
 */
pivot: Pivot,
/**
 * Radius of proportional editing, as a fraction of the cage's diagonal. Kept while `proportional_on` is false.
 */
proportional: number,
/**
 * Whether vertices near the selection follow it.
 */
proportionalOn: boolean, };
/**
 * Name of the animation of the saved poses, how it goes from one to the next, and how it ends.
 */
export type Transition = {
/**
 * Name of the clip in exported files; empty if the user has not named it.
 */
name: string,
/**
 * Interpolation towards poses that have none of their own, and of the return to the start.
 */
interpolation: Interpolation,
/**
 * Whether the animation returns to the shape at its start after the last pose, so that it can repeat.
 */
loops: boolean,
/**
 * Time of the return from the last pose to the shape at the start, seconds.
 */
back: number, };
/**
 * The up axis of a file. In memory Y is always up: files with another axis are rotated about x when
 * they are read, and back when they are written. The rotations are exact.
 */
export type UpAxis = "y" | "z" | "y_down";
/**
 * Document and bind state that panels show.
 */
export type View = {
/**
 * Whether the models are bound to the current cage.
 */
bound: boolean,
/**
 * Whether weights on a lattice around the cage are available.
 */
lattice: boolean,
/**
 * Number of splats outside the cage; 0 before the lattice is available.
 */
floaters: number,
/**
 * Key that changes whenever the models, their options or the areas that the user fixed with the brush change.
 */
models: number,
/**
 * Key that changes whenever the models' joined mesh changes.
 */
mesh: number,
/**
 * Key that changes whenever the cage at rest changes.
 */
cage: number,
/**
 * Identifies the content of the cage at rest; saved poses fit cages with equal identifiers.
 */
cageId: number,
/**
 * Names and times of the saved poses, in the order of the list.
 */
poses: Array<PoseView>,
/**
 * Share of each saved pose in the current pose.
 */
shares: Array<number>,
/**
 * Whether the pose differs from the blend of the saved poses by `shares`.
 */
modified: boolean,
/**
 * Name of the animation of the saved poses, how it goes from one to the next, and how it ends.
 */
transition: Transition,
/**
 * Length of the animation of the saved poses, seconds.
 */
animationSeconds: number,
/**
 * Surface points that pulls keep in place.
 */
pins: Array<SurfacePoint>,
/**
 * Whether the pose differs from the cage at rest; false while the cage is being reshaped.
 */
posed: boolean,
/**
 * Factors of the humanoid's proportions, on the left and on the right. `[n_proportions, 2]`
 */
factors: Array<number>,
/**
 * Name of the preset that the factors are, if they are one.
 */
preset: string | null,
/**
 * Whether a factor differs from 1. An export then keeps the ground, unless the user has switched that off.
 */
scaled: boolean,
/**
 * Whether the cage is being reshaped.
 */
editingRest: boolean,
/**
 * Identifier of the built-in sample that is open.
 */
sample: string | null,
/**
 * Whether the cage is the built-in one of `sample`; smoothing and inner controls may differ.
 */
sampleCage: boolean,
/**
 * Number, last vertex and centre of the selected vertices.
 */
selected: SelectionView,
/**
 * How clicks and gestures act on the cage.
 */
tools: Tools,
/**
 * Number of vertices without a mirror image; 0 unless gestures also move mirror images.
 */
unmatched: number,
/**
 * Number of openings, steps, undos and redos so far.
 */
steps: number,
/**
 * Label of the step that undo reverts.
 */
undo: string | null,
/**
 * Label of the step that redo repeats.
 */
redo: string | null,
/**
 * Number of steps that were dropped because the history exceeded its limit.
 */
forgotten: number, };
/**
 * Clips that the cage can follow, for panels.
 */
export type WalkInfo = {
/**
 * Names and lengths of the clips, seconds.
 */
clips: Array<[string, number]>,
/**
 * A sentence if the limbs were not found.
 */
notice: string | null, };
/**
 * Statistics of the stored weights.
 */
export type WeightStats = {
/**
 * Smallest weight.
 */
min: number,
/**
 * Largest weight.
 */
max: number,
/**
 * Largest `|sum of a row - 1|`.
 */
max_sum_error: number,
/**
 * Number of stored weights.
 */
nonzeros: number, };
export const BIND_DEFAULTS: BindOptions = {"backend":"gpu","grid":0,"method":"embedded","solver":"multigrid","tau":0.00001,"max_iterations":20000,"sparsify":0.0,"memory_limit":2147483648,"outside":"extend"};
export const CAGE_DEFAULTS: CageOptions = {"target":80,"detail":0.028,"quads":true,"kind":"auto","symmetry":"auto","per_component":false,"clearance":0.0,"voxels":0};
export const RIG_DEFAULTS: RigOptions = {"joints":"follow","keep_travel":false,"rigid":[],"ground":false,"feet":"free","expressions":false,"plain":false,"dynamic":false,"ground_off":false};
export const VIEW_DEFAULTS: View = {"models":0,"mesh":0,"cage":0,"cageId":0,"poses":[],"shares":[],"modified":false,"transition":{"name":"","interpolation":"linear","loops":true,"back":1.0},"animationSeconds":0.0,"pins":[],"posed":false,"factors":[],"preset":null,"scaled":false,"editingRest":false,"sample":null,"sampleCage":false,"selected":{"count":0,"last":null,"center":null},"tools":{"element":"vertex","symmetry":false,"pivot":"middle","proportional":0.2,"proportionalOn":false},"unmatched":0,"steps":0,"undo":null,"redo":null,"forgotten":0,"bound":false,"lattice":false,"floaters":0};
export const SCENE_DEFAULTS: SceneOptions = {"theme":"dark","base_wireframe":false,"floor":true,"floaters":true,"weights_to_one":false,"model":true,"cage":true,"original":false,"colour":"material","slice":"off","gizmo":null,"pull":true,"compare":["harmonic"],"problems":true,"joints":null,"ground":false};
export const COORDINATES: readonly Coordinates[] = ["harmonic","mean_value","green"];
/** File extensions of models, preferred first. */
export const MODEL_ENDINGS = ["glb", "vrm", "gltf", "fbx", "obj", "ply", "stl", "off", "3mf", "splat", "spz", "sog"] as const;
/** Names of model files whose extension is not that of a model. */
export const MODEL_NAMES = ["meta.json"] as const;
/** MIME types of models. */
export const MODEL_TYPES = ["model/gltf-binary", "model/gltf+json", "model/obj", "model/stl", "model/3mf"] as const;
/** Extensions of models that refer to other files. */
export const NAMING_ENDINGS = ["gltf", "fbx", "obj", "json"] as const;
/** Extensions of these other files. */
export const COMPANION_ENDINGS = ["bin", "png", "jpg", "jpeg", "webp", "ktx2", "mtl"] as const;
/** Formats that store only a shape. */
export const SHAPE_FORMATS = ["obj", "ply", "stl", "off", "3mf"] as const;
/** Formats that store splats and nothing else. */
export const SPLAT_FORMATS = ["ply", "splat", "spz"] as const;
/** MIME types of exported models, by extension. */
export const EXPORT_TYPES: Readonly<Record<string, string>> = { "glb": "model/gltf-binary", "vrm": "model/gltf-binary", "gltf": "model/gltf-binary", "obj": "model/obj", "stl": "model/stl", "3mf": "model/3mf", };
/** Sliders of options, by name. */
export const SLIDERS = { tau: {"min":-8.0,"max":-2.0,"step":1.0}, max_iterations: {"min":1.0,"max":1000000.0,"step":1.0}, target: {"min":8.0,"max":400.0,"step":2.0}, detail: {"min":0.007,"max":0.112,"step":0.05}, clearance: {"min":0.0,"max":0.15,"step":0.005}, voxels: {"min":16.0,"max":128.0,"step":8.0}, divisions: {"min":1.0,"max":8.0,"step":1.0}, radius: {"min":0.005,"max":0.12,"step":0.0025}, proportional: {"min":0.02,"max":1.0,"step":0.01}, brush: {"min":0.01,"max":0.3,"step":0.01}, reach: {"min":0.05,"max":2.4,"step":0.05}, factor: {"min":0.5,"max":2.0,"step":0.01}, } as const;
export const BOX_DIVISIONS = 2;
export const HULL_TARGET = 24;
/** Proportions of a humanoid, in the order of their sliders. */
export const PROPORTIONS = [{"name":"leg","group":"Limbs","sided":true,"natural":[0.6,1.4]},{"name":"arm","group":"Limbs","sided":true,"natural":[0.7,1.3]},{"name":"torso","group":"Trunk","sided":false,"natural":[0.75,1.3]},{"name":"neck","group":"Head and height","sided":false,"natural":[0.5,2.0]},{"name":"head","group":"Head and height","sided":false,"natural":[0.8,1.8]},{"name":"hand","group":"Limbs","sided":true,"natural":[0.7,1.4]},{"name":"foot","group":"Limbs","sided":true,"natural":[0.7,1.4]},{"name":"shoulder","group":"Trunk","sided":false,"natural":[0.8,1.3]},{"name":"hip","group":"Trunk","sided":false,"natural":[0.85,1.2]},{"name":"limb","group":"Limbs","sided":true,"natural":[0.75,1.4]},{"name":"waist","group":"Trunk","sided":false,"natural":[0.75,1.4]},{"name":"height","group":"Head and height","sided":false,"natural":[0.5,2.0]}] as const;
/** Presets of proportions. */
export const PRESETS = ["longer legs", "big head", "hero", "chibi", "slim", "stout"] as const;
/** Maximum length of a picture's longer side, pixels. */
export const MAX_PICTURE = 8192;
/** Default solver of each method. */
export const USUAL_SOLVERS: Record<Method, Solver> = {"classic":"jacobi","embedded":"multigrid"};
