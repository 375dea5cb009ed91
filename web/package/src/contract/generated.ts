// Written by crates/cagework-web/src/border.rs from Rust's types. To change them, change those.

/**
 * Kinds of errors that the page handles differently.
 */
export type ErrorName = "Cancelled" | "Compressed" | "Format" | "Memory" | "WeightsMemory" | "Outside" | "NoneInside" | "NoAdapter" | "NoDevice" | "DeviceLost" | "Gpu" | "Canvas" | "Missing" | "Error";
/**
 * Discretisation of the cage.
 */
export type Method = "classic" | "embedded";
/**
 * Solver of Laplace's equation.
 */
export type Solver = "jacobi" | "multigrid" | "cg";
/**
 * Preconditioner of conjugate gradients.
 */
export type Preconditioner = "none" | "v_cycle";
/**
 * Processor of a bind.
 */
export type Backend = "cpu" | "gpu";
/**
 * Cell shape of the classic method.
 */
export type CellShape = "box" | "cubic";
/**
 * Norm of the change of a cell in Eq. 2 of the paper.
 */
export type DeltaNorm = "euclidean" | "literal";
/**
 * Treatment of mesh vertices outside the cage.
 */
export type OutsidePolicy = "extend" | "stay" | "refuse";
/**
 * Options of a bind, and the processor that it runs on.
 */
export type BindOptions = { backend: Backend,
/**
 * Cells along the longest side (each side for classic box cells), 8 to 512. Default 64.
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
 * Preconditioner of conjugate gradients. Default none.
 */
preconditioner: Preconditioner,
/**
 * Cell shape of the classic method. Default box.
 */
cell_shape: CellShape,
/**
 * Delta of Jacobi sweeps. Default Euclidean.
 */
delta_norm: DeltaNorm,
/**
 * Convergence threshold for delta. Default 1e-5.
 */
tau: number,
/**
 * Limit on Jacobi sweeps, V-cycles, or steps of conjugate gradients. Default 20,000.
 */
max_iterations: number,
/**
 * Drops the smallest weights of each row up to this total, then restores sum and rest position. 0 keeps all.
 * Default 0.
 */
sparsify: number,
/**
 * Fails before the bind if it needs more bytes of memory, including `held`. Default 4 GiB; 2 GiB in wasm.
 */
memory_limit: number,
/**
 * Treatment of vertices outside the cage. Default extend.
 */
outside: OutsidePolicy, };
/**
 * Stages of a bind, in order, and of cage generation.
 */
export type Stage = "voxelize" | "solve" | "sample" | "simplify";
/**
 * A [`ProgressEvent`] as JavaScript receives it.
 */
export type Progress = { stage: Stage, fraction: number, iteration: number, delta: number | null, };
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
 * Weight and gradient (per object unit) of each vertex of the cage at each joint. `[n_joints, n_cage]`
 */
plain: Array<[number, number, number, number]>, };
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
 * Frames of a bind, and the points outside the cage. The frames' columns of the weights follow those of the controls.
 */
export type Offsets = {
/**
 * Frames. In the weights, their columns follow those of the controls.
 */
frames: Frames,
/**
 * Points outside the cage.
 */
outside: Array<OutsideVertex>, };
/**
 * Report of a bind.
 */
export type BindReport = {
/**
 * Discretisation of the cage: classic (as published) or embedded.
 */
method: Method,
/**
 * Solver of Laplace's equation: Jacobi, multigrid, or conjugate gradients.
 */
solver: Solver,
/**
 * Preconditioner of conjugate gradients.
 */
preconditioner: Preconditioner,
/**
 * Processor that computed the bind.
 */
backend: Backend,
/**
 * Name of the GPU, if it solved.
 */
adapter?: string,
/**
 * Number of threads that solved.
 */
threads: number,
/**
 * Requested number of cells along the longest side.
 */
grid: number,
/**
 * Cells of the grid along x, y, z.
 */
dims: [number, number, number],
/**
 * Edge lengths of a cell, object units.
 */
cell_size: [number, number, number],
/**
 * Shape of the cells: rectangular (as published) or cubic.
 */
cell_shape: CellShape,
/**
 * Norm of the change of a cell in Eq. 2 of the paper.
 */
delta_norm: DeltaNorm,
/**
 * Convergence threshold for delta.
 */
tau: number,
/**
 * Cells of the finest grid by kind.
 */
cells: CellCounts,
/**
 * Unknowns of each level, finest first; one entry for Jacobi.
 */
levels: Array<number>,
/**
 * Jacobi sweeps, V-cycles on the finest level, or steps of conjugate gradients; maximum over batches.
 */
iterations: number,
/**
 * Whether delta fell below tau within the limit on iterations.
 */
converged: boolean,
/**
 * Whether f32 precision ended the solve before delta fell below tau.
 */
at_round_off: boolean,
/**
 * Delta after every `delta_interval` iterations. Jacobi: Eq. 2, the mean change of a cell per sweep. Other
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
 * Bytes of working memory.
 */
memory_bytes: MemoryBytes,
/**
 * Rest error: distance of `sum_i w_i c_i` from the mesh vertex (Eq. 3), over vertices inside the cage.
 */
rest_error: RestError,
/**
 * Error of the rows of weights before correction, which is the error of the solver alone.
 */
raw_error: RawError,
/**
 * Statistics of the stored weights.
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
 * Largest distance from the cage of a mesh vertex outside it, object units.
 */
outside_distance: number,
/**
 * Number of mesh vertices inside balls and tubes.
 */
held_vertices: number,
/**
 * Number of cells that lines along the three axes classify differently.
 */
ambiguous_cells: number,
/**
 * Notices in whole sentences, such as flipped faces or unused vertices.
 */
notices: Array<string>, };
/**
 * Numbers of cells by kind.
 */
export type CellCounts = {
/**
 * Cells inside the cage, whose weights are the unknowns.
 */
interior: number,
/**
 * Cells that the cage's surface intersects.
 */
boundary: number,
/**
 * Cells outside the cage.
 */
exterior: number, };
/**
 * Stage times in milliseconds.
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
 * Working memory, bytes.
 */
export type MemoryBytes = {
/**
 * Estimate before the bind.
 */
estimated: number,
/**
 * Largest sum of buffers alive at the same time.
 */
peak: number, };
/**
 * Reconstruction error of the rest pose (Eq. 3).
 */
export type RestError = {
/**
 * Mean, object units.
 */
mean: number,
/**
 * 99th percentile, object units.
 */
p99: number,
/**
 * Largest, object units.
 */
max: number,
/**
 * Mean, as a fraction of the diagonal of the cage's bounding box.
 */
mean_rel: number,
/**
 * Largest, as a fraction of the diagonal of the cage's bounding box.
 */
max_rel: number, };
/**
 * Error of the rows before correction, over vertices inside the cage. Operator and sampling reproduce linear functions
 * exactly, so with the embedded method this error is that of the solver.
 */
export type RawError = {
/**
 * `|sum_i w_i - 1|`.
 */
sum: MeanMax,
/**
 * Distance of `sum_i w_i c_i` from the vertex, as a fraction of the diagonal of the cage's bounding box.
 */
point_rel: MeanMax,
/**
 * Smallest value, before negative values are clamped to 0.
 */
min_weight: number, };
/**
 * Mean and maximum.
 */
export type MeanMax = {
/**
 * Mean.
 */
mean: number,
/**
 * Largest.
 */
max: number, };
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
/**
 * Shape that the cage follows.
 */
export type Shape = "follow" | "hull";
/**
 * Options of [`super::generate`]. Aliases are their names on the page, in projects and in JavaScript.
 */
export type CageOptions = {
/**
 * Target number of vertices, 8 to 400. Default 80.
 */
vertices: number,
/**
 * Allowed RMS distance of the cage from the shape that it follows, as a fraction of the model's longest side,
 * 0.005 to 0.2. Simple shapes get fewer vertices than the target. Default 0.028, a voxel of 36.
 */
detail: number,
/**
 * Whether to pair triangles into quads. Default true.
 */
quads: boolean,
/**
 * Shape that the cage follows. Default follow.
 */
shape: Shape,
/**
 * Mirror symmetry. Default auto.
 */
symmetry: "auto" | "on" | "off",
/**
 * Whether each part of the model gets its own closed cage (parts within a few voxels of each other count as one).
 * Otherwise thin bridges join them to one cage. Default false.
 */
per_component: boolean,
/**
 * Distance to keep from the model along each axis, as a fraction of the diagonal of its box, 0 to 0.25; at least
 * half a voxel. Default 0.
 */
margin: number,
/**
 * Voxels along the model's longest side, 8 to 128, or 0 to derive them from the target. Gaps narrower than three
 * voxels are closed, detail thinner than one is lost. Default 0.
 */
voxels: number, };
/**
 * Lower and upper corner of an axis-aligned box.
 */
export type Bounds = { min: [number, number, number], max: [number, number, number], };
/**
 * An element of inner controls: indices into [`InnerControls::positions`].
 */
export type InnerElement = { "point": number } | { "line": Array<number> } | { "face": Array<number> };
/**
 * A kind of interior control.
 */
export type InnerKind = "point" | "line" | "face";
/**
 * Subdivision and interior controls of a cage.
 */
export type CageControls = {
/**
 * Number of subdivision steps.
 */
smooth: number,
/**
 * Number of interior controls: the last of the cage's positions.
 */
inner: number,
/**
 * Points, lines and faces; indices are relative to the first interior control.
 */
elements: Array<InnerElement>,
/**
 * Radius of points and lines, object units; null for a share of the cage's size.
 */
radius: number | null, };
/**
 * Counts, bounds and notices of the cage.
 */
export type CageInfo = { vertices: number, edges: number, faces: number,
/**
 * Number of quads among the faces.
 */
quads: number, triangles: number, bounds: Bounds, notices: Array<string>, };
/**
 * The cage's properties, and its interior controls.
 */
export type CageState = { usable: boolean, info: CageInfo, controls: CageControls,
/**
 * Radius of interior point and line controls, object units.
 */
radius: number, };
/**
 * Kinds of problems. The names are part of the file format and stay stable.
 */
export type Code = "empty" | "not_finite" | "bad_index" | "degenerate_face" | "duplicate_face" | "duplicate_vertex" | "open_edge" | "non_manifold_edge" | "non_manifold_vertex" | "flipped" | "one_sided" | "self_intersection" | "unused_vertex" | "model_outside" | "thin_part" | "not_a_cage";
/**
 * Severity of a problem.
 */
export type Severity = "error" | "warning" | "note";
/**
 * A repair.
 */
export type Repair = "weld" | "drop_degenerate" | "mirror" | "fill_holes" | "flip" | "grow";
/**
 * What the button of a fix does.
 */
export type Mend = { "kind": "repair", repair: Repair, } | { "kind": "grid", cells: number, } | { "kind": "regenerate" };
/**
 * Faults of one kind in a cage: their number, and the best fix.
 */
export type Problem = { code: Code, severity: Severity,
/**
 * Message of one or more complete sentences.
 */
message: string, count: number, fix: Mend | null, };
/**
 * File format of a model.
 */
export type ModelFormat = "gltf" | "obj" | "ply" | "stl" | "off" | "splat" | "spz";
/**
 * The up axis of a file. In memory Y is always up: files with another axis are rotated about x when
 * they are read, and back when they are written. The rotations are exact.
 */
export type UpAxis = "y" | "z" | "y_down";
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
 * One of the models in a cage.
 */
export type MemberInfo = {
/**
 * Identifier, which stays the same for the model's lifetime.
 */
id: number, name: string, format: ModelFormat, vertices: number, triangles: number, rigged: boolean,
/**
 * Names of the parts, prefixed by their kind, such as `material:Cloth`.
 */
parts: Array<string>, options: PartOptions,
/**
 * Whether some vertices of the model are painted to stay in place.
 */
painted: boolean, };
/**
 * Settings of a model in a project.
 */
export type MemberSettings = {
/**
 * Number by which surface points refer to the model's first triangle.
 */
first_triangle: number, options: PartOptions,
/**
 * Painted amounts as runs of (amount 0 to 255, number of vertices); empty for an unpainted model.
 */
painted: Array<[number, number]>, };
/**
 * Properties of the models in the cage, taken together.
 */
export type ModelInfo = {
/**
 * Name of the first model.
 */
name: string, format: ModelFormat, up: UpAxis, vertices: number, triangles: number, faces: number, materials: number, textures: number, skins: number, joints: number, clips: Array<ClipView>,
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
rigged: boolean, bounds: Bounds,
/**
 * Whether the models seem to lie on their back, because the file's up axis is z.
 */
lies: boolean, notices: Array<string>,
/**
 * Properties of each model.
 */
members: Array<MemberInfo>, };
/**
 * What a clip shows between two keys, as in glTF 2.0, appendix C.
 */
export type Interpolation = "step" | "linear" | "cubic";
/**
 * How the animation of the saved poses goes from one to the next, and how it ends.
 */
export type Transition = {
/**
 * Interpolation between two poses.
 */
interpolation: Interpolation,
/**
 * Whether the animation returns to the shape at its start after the last pose, so that it can repeat.
 */
loops: boolean,
/**
 * Time that this return takes, seconds.
 */
back: number, };
/**
 * Settings of a document in a project.
 */
export type DocumentSettings = {
/**
 * Identifier of the built-in sample that the cage belongs to.
 */
sample?: string | null,
/**
 * Subdivision and interior controls; the controls are the last positions of the cage.
 */
controls?: CageControls | null,
/**
 * The pose in the axes of the model's file: [`cagework_io::encode_pose`] in URL-safe base 64. Null at rest.
 */
pose?: string | null,
/**
 * Surface points that pulls keep in place.
 */
pins?: Array<SurfacePoint>,
/**
 * Surface points that pulls keep in place, of each saved pose.
 */
pose_pins?: Array<Array<SurfacePoint>>,
/**
 * Share of each saved pose in the pose, 0 to 1.
 */
pose_shares?: Array<number>,
/**
 * Time from the previous pose to each saved pose, seconds. If empty, one second each.
 */
pose_leads?: Array<number>,
/**
 * How the animation of the saved poses goes from one to the next, and how it ends.
 */
transition?: Transition | null,
/**
 * Visibility, parts and painted amounts of each model.
 */
models?: Array<MemberSettings>, };
/**
 * A change of the document.
 */
export type Command = { "do": "set_pose",
/**
 * Positions of cage vertices and interior controls, object units.
 */
positions: readonly (readonly [number, number, number])[], } | { "do": "reset_pose" } | { "do": "save_pose",
/**
 * Name of the new saved pose.
 */
name: string, } | { "do": "apply_pose",
/**
 * Index of the pose.
 */
index: number, } | { "do": "rename_pose",
/**
 * Index of the pose.
 */
index: number,
/**
 * New name of the pose.
 */
name: string, } | { "do": "remove_pose",
/**
 * Index of the pose.
 */
index: number, } | { "do": "update_pose",
/**
 * Index of the pose.
 */
index: number, } | { "do": "duplicate_pose",
/**
 * Index of the pose.
 */
index: number,
/**
 * Name of the copy.
 */
name: string, } | { "do": "move_pose",
/**
 * Index of the pose.
 */
index: number,
/**
 * Its new index.
 */
to: number, } | { "do": "set_pose_time",
/**
 * Index of the pose.
 */
index: number,
/**
 * Seconds since the start of the animation.
 */
seconds: number, } | { "do": "set_transition",
/**
 * The new settings.
 */
transition: Transition, } | { "do": "blend",
/**
 * Index of the pose.
 */
index: number,
/**
 * Share, 0 to 1.
 */
share: number, } | { "do": "carry_poses",
/**
 * Number of controls of the other cage.
 */
from: number,
/**
 * Positions of the controls of this cage, concatenated over the poses. `[n_poses, n_controls]`
 */
positions: readonly (readonly [number, number, number])[],
/**
 * Shares of the saved poses in the pose.
 */
shares: Array<number>, } | { "do": "set_pins",
/**
 * Points on the surfaces of the models.
 */
pins: Array<SurfacePoint>, } | { "do": "replace_cage",
/**
 * Positions of the vertices of the new cage, then of its interior controls, and the cage's faces.
 */
mesh: unknown,
/**
 * Subdivision and interior controls; null keeps the current ones that fit.
 */
controls: CageControls | null,
/**
 * Notices of the generator.
 */
notices: Array<string>, } | { "do": "move_rest" } | { "do": "edit_rest",
/**
 * Kind of edit.
 */
edit: RestEdit, } | { "do": "subdivide",
/**
 * Steps, 0 to 3.
 */
steps: number, } | { "do": "set_radius",
/**
 * Radius, object units; null for a fixed fraction of the cage's size.
 */
radius: number | null, } | { "do": "add_control",
/**
 * A point, a polyline through `places`, or a sheet with corners at `places`.
 */
kind: InnerKind,
/**
 * Positions, object units.
 */
places: readonly (readonly [number, number, number])[], } | { "do": "add_sheet",
/**
 * Centre of the sheet.
 */
center: readonly [number, number, number],
/**
 * Half axes of the largest size that is tried.
 */
axes: readonly (readonly [number, number, number])[], } | { "do": "replace_controls",
/**
 * Positions of the new controls.
 */
positions: readonly (readonly [number, number, number])[],
/**
 * Points, lines and faces; indices are relative to `positions`.
 */
elements: Array<InnerElement>, } | { "do": "remove_model",
/**
 * Id of the model.
 */
id: number, } | { "do": "set_parts",
/**
 * Id of the model.
 */
id: number,
/**
 * Visibility and parts.
 */
options: PartOptions, } | { "do": "set_painted",
/**
 * Id of the model.
 */
id: number,
/**
 * Amounts, 0 (moves with the cage) to 255 (stays in place). `[n_vertices]`, or empty for an unpainted model
 */
amounts: Array<number>, };
/**
 * A saved pose.
 */
export type PoseView = {
/**
 * Name of the pose.
 */
name: string,
/**
 * Whether the pose belongs to the current cage rather than a replaced one.
 */
fits: boolean,
/**
 * Time in the animation, seconds; 0 if the pose belongs to a replaced cage.
 */
seconds: number, };
/**
 * The selection.
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
 * Document and bind state that panels show.
 */
export type View = {
/**
 * Whether the models are bound to the current cage.
 */
bound: boolean,
/**
 * Changes with the models, their options and painted amounts.
 */
models: number,
/**
 * Changes with the models' joined mesh.
 */
mesh: number,
/**
 * Changes with the cage at rest.
 */
cage: number,
/**
 * Saved poses.
 */
poses: Array<PoseView>,
/**
 * Share of each saved pose in the pose.
 */
shares: Array<number>,
/**
 * How the animation of the saved poses goes from one to the next, and how it ends.
 */
transition: Transition,
/**
 * Length of this animation, seconds.
 */
animationSeconds: number,
/**
 * Surface points that pulls keep in place.
 */
pins: Array<SurfacePoint>,
/**
 * Whether the pose differs from the cage at rest.
 */
posed: boolean,
/**
 * Whether the cage is being reshaped.
 */
editingRest: boolean,
/**
 * Identifier of the built-in sample that is open.
 */
sample: string | null,
/**
 * Whether the cage is the one of the sample.
 */
sampleCage: boolean,
/**
 * The selection.
 */
selected: SelectionView,
/**
 * Changes with each step, undo and redo.
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
 * A cage that the page opens.
 */
export type CageContents = {
/**
 * Positions of the cage's vertices and interior controls. `[n_controls, 3]`
 */
positions: Float32Array,
/**
 * For each face its corner count, then its vertex indices.
 */
corners: Uint32Array, controls?: CageControls | null, notices: Array<string>, };
/**
 * A named pose.
 */
export type PoseContents = { name: string,
/**
 * Positions of the cage's vertices and interior controls. `[n_controls, 3]`
 */
positions: Float32Array, };
/**
 * Contents that the page opens together with models.
 */
export type OpenContents = {
/**
 * Identifier of the built-in sample; undefined for other models.
 */
sample: string | null,
/**
 * JSON of the page's settings in a project.
 */
settings: string | null, cage: CageContents | null,
/**
 * Poses of a sample. The poses of a project are in its `Loaded`.
 */
poses: Array<PoseContents>, };
/**
 * Settings of a project, with all values valid.
 */
export type Settings = { bind?: BindOptions, cage?: CageOptions, rig?: RigOptions, symmetry?: boolean,
/**
 * Notices about values that were replaced by defaults, one sentence each.
 */
notices: Array<string>, };
/**
 * Colours of background and overlays.
 */
export type Theme = "dark" | "light";
/**
 * Quantity that the colours of the model show.
 */
export type Colour = "material" | "clay" | "weight" | "error";
/**
 * Kind of coordinates.
 */
export type Coordinates = "harmonic" | "mean_value" | "green";
/**
 * Quantity that the slice shows.
 */
export type SliceShown = "off" | "kinds" | "value";
/**
 * Type of gizmo.
 */
export type Gizmo = "none" | "move" | "rotate" | "scale";
/**
 * What the scene shows.
 */
export type SceneOptions = { theme: Theme, model: boolean, base_wireframe: boolean, cage: boolean, floor: boolean, original: boolean, colour: Colour,
/**
 * Whether the colour scale of weights ends at 1 rather than at the largest weight.
 */
weights_to_one: boolean, slice: SliceShown, gizmo: Gizmo,
/**
 * Whether dragging pulls the model's surface. The cage is then drawn faintly.
 */
pull: boolean,
/**
 * Kinds of coordinates shown side by side, from the left. Kinds that are not computed yet are skipped.
 */
compare: Array<Coordinates>, problems: boolean,
/**
 * Treatment of joints by the next export, which the marks of joints show. Null hides the marks.
 */
joints: Joints | null, };
/**
 * Position and direction of the camera.
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
 * A point on the surface of the models.
 */
export type SurfacePoint = {
/**
 * Number of the triangle; see [`Models`].
 */
triangle: number,
/**
 * Barycentric coordinates in the triangle.
 */
bary: [number, number, number], };
/**
 * Weights of a surface point, and the nearest vertex of the model.
 */
export type Grip = {
/**
 * Weights of the cage's vertices at the point. `[n_cage]`
 */
row: Array<number>,
/**
 * Index of the nearest vertex of the model.
 */
seed: number, };
/**
 * Options for pulling the model's surface.
 */
export type PullOptions = {
/**
 * Distance along the surface that a pull affects, as a fraction of the model's size; null for automatic.
 */
reach: number | null,
/**
 * Whether a pull affects the whole model, without a limit of distance.
 */
whole: boolean,
/**
 * Whether the mirror image of the grabbed point is pulled symmetrically.
 */
mirrored: boolean, };
/**
 * How the skeleton follows the cage.
 */
export type Joints = "follow" | "stay" | "turn";
/**
 * Options for exporting a rig.
 */
export type RigOptions = { joints: Joints,
/**
 * Whether translations in clips keep their length; otherwise they scale with the height of the hips.
 */
keep_travel: boolean,
/**
 * Names of parts that move rigidly, without changing their shape.
 */
rigid: Array<string>,
/**
 * Whether to export only the shape, without the rig.
 */
plain: boolean,
/**
 * Whether the cage deforms the model after a clip has moved it.
 */
dynamic: boolean, };
/**
 * An animation clip.
 */
export type ClipView = {
/**
 * Name of the clip, or its number if it has no name.
 */
name: string, seconds: number, };
/**
 * A morph target and its default weight.
 */
export type TargetView = { name: string, default: number, };
/**
 * Colour map that a legend shows.
 */
export type ColorMap = "viridis" | "error" | "kinds";
/**
 * The largest weight, and the index of the model vertex that has it.
 */
export type Largest = { value: number, vertex: number, };
/**
 * Legend of the colours of the slice or the model.
 */
export type Legend = { low: number, high: number, logarithmic: boolean, map: ColorMap,
/**
 * Largest of the displayed weights; null for other quantities.
 */
largest: Largest | null, };
/**
 * Element type that a click selects.
 */
export type Element = "vertex" | "edge" | "face";
/**
 * Centre of rotation and scaling.
 */
export type Pivot = "middle" | "border" | "last";
/**
 * How a set of vertices changes the selection.
 */
export type SelectMode = "replace" | "add" | "remove" | "toggle";
/**
 * Kind of gesture.
 */
export type Gesture = "grab" | "rotate" | "scale";
/**
 * How far a gesture has moved, for a status line.
 */
export type GestureView = {
/**
 * Kind of the gesture.
 */
kind: Gesture,
/**
 * Movement along the axis or along x, y and z, object units; the angle in degrees; or the factor.
 */
amounts: Array<number>,
/**
 * Axis of the restriction, 0 to 2.
 */
axis: number | null,
/**
 * Whether the gesture is restricted to the plane normal to `axis`.
 */
plane: boolean, };
/**
 * Handle of the gizmo: one axis, the plane normal to an axis, or all axes.
 */
export type GizmoHandle = "x" | "y" | "z" | "plane_x" | "plane_y" | "plane_z" | "all";
/**
 * An edit of the selected elements of the cage.
 */
export type RestEdit = "split_edge" | "collapse_edge" | "extrude_face" | "delete_vertex" | "delete_face";
export const BIND_DEFAULTS: BindOptions = {"backend":"gpu","grid":64,"method":"embedded","solver":"multigrid","preconditioner":"none","cell_shape":"box","delta_norm":"euclidean","tau":0.00001,"max_iterations":20000,"sparsify":0.0,"memory_limit":2147483648,"outside":"extend"};
export const CAGE_DEFAULTS: CageOptions = {"vertices":80,"detail":0.028,"quads":true,"shape":"follow","symmetry":"auto","per_component":false,"margin":0.0,"voxels":0};
export const RIG_DEFAULTS: RigOptions = {"joints":"follow","keep_travel":false,"rigid":[],"plain":false,"dynamic":false};
export const SCENE_DEFAULTS: SceneOptions = {"theme":"dark","model":true,"base_wireframe":false,"cage":true,"floor":true,"original":false,"colour":"material","weights_to_one":false,"slice":"off","gizmo":"none","pull":true,"compare":["harmonic"],"problems":true,"joints":null};
export const COORDINATES: readonly Coordinates[] = ["harmonic","mean_value","green"];
/** File extensions of models, preferred first. */
export const MODEL_ENDINGS = ["glb", "vrm", "gltf", "obj", "ply", "stl", "off", "splat", "spz"] as const;
/** MIME types of models. */
export const MODEL_TYPES = ["model/gltf-binary", "model/gltf+json", "model/obj", "model/stl"] as const;
/** Extensions of models that refer to other files. */
export const NAMING_ENDINGS = ["gltf", "obj"] as const;
/** Extensions of these other files. */
export const COMPANION_ENDINGS = ["bin", "png", "jpg", "jpeg", "webp", "ktx2", "mtl"] as const;
/** Formats that store only a shape. */
export const SHAPE_FORMATS = ["obj", "ply", "stl", "off"] as const;
/** MIME types of exported models, by extension. */
export const EXPORT_TYPES: Readonly<Record<string, string>> = { glb: "model/gltf-binary", vrm: "model/gltf-binary", gltf: "model/gltf-binary", obj: "model/obj", stl: "model/stl", };
/** Sliders of options, by name. */
export const SLIDERS = { tau: {"min":-8.0,"max":-2.0,"step":1.0}, max_iterations: {"min":1.0,"max":1000000.0,"step":1.0}, vertices: {"min":8.0,"max":400.0,"step":2.0}, detail: {"min":0.007,"max":0.112,"step":0.05}, margin: {"min":0.0,"max":0.15,"step":0.005}, voxels: {"min":16.0,"max":128.0,"step":8.0}, divisions: {"min":1.0,"max":8.0,"step":1.0}, radius: {"min":0.005,"max":0.12,"step":0.0025}, proportional: {"min":0.02,"max":1.0,"step":0.01}, brush: {"min":0.01,"max":0.3,"step":0.01}, reach: {"min":0.05,"max":2.4,"step":0.05}, } as const;
export const BOX_DIVISIONS = 2;
