//! Renders the scene into a canvas or a texture.
//!
//! The renderer reads the vertex buffers written by `deform_vertices` and `vertex_normals` without copies; a frame
//! uploads a few hundred bytes. On devices that only draw, the same tables are textures ([`crate::table`]). Colours are
//! linear, blended premultiplied, with 4x multisampling. Data that rarely changes (selection, styles, heat map) is
//! uploaded on change.
//!
//! Drawing order: background, opaque mesh, slice, translucent mesh, floor, edges, cage (first its parts behind the
//! mesh, fainter), controls inside the cage, handles, marks, gizmo. If there are splats, the floor and then the splats
//! are drawn before the mesh, which then only fills the depth buffer.
//!
//! **Target format.** To sRGB formats (`rgba8unorm-srgb`), shaders write linear colours, which the GPU converts to
//! sRGB. Canvases have no sRGB format: configure the preferred format, list its sRGB variant in `view_formats`, and
//! draw into a view with this variant. If that is not possible, use any 8-bit format: shaders then convert colours to
//! sRGB, and blending differs slightly.

mod cage;
pub mod camera;
pub mod colormap;
mod controls;
mod eye;
mod frame;
mod gizmo;
mod layers;
pub mod layout;
mod marks;
mod mesh;
pub mod model;
mod overlay;
mod part;
mod pipelines;
pub mod scene;
pub mod shaders;
mod shadow;
mod slice;
mod splats;
mod texture;
mod theme;

pub use camera::{AxisView, Camera, CameraPlace, CameraView, ImagePoint, Projection, Ray};
pub(crate) use frame::MAX_SAMPLES;
pub use frame::{Renderer, Target};
pub use gizmo::{GIZMO_PX, pick_gizmo};
pub use layers::check_layers;
pub use model::{Alpha, DrawGroup, DrawModel, DrawTexture, DrawVertex, Wrap};
pub use part::PartPainter;
pub use scene::{
    Gizmo, GizmoMode, GizmoPart, Marks, MeshStyle, SceneOptions, Selection, SliceView, Theme, ViewOptions,
};
pub(crate) use theme::divide_by_alpha;
