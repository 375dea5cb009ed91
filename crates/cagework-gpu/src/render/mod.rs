//! The renderer: a picture of the scene, into a page's canvas or a texture of its own.
//!
//! It reads the vertex buffers that `deform_vertices` and `vertex_normals` wrote; nothing is copied, and a frame
//! uploads a few hundred bytes. Where the device only draws, the same tables are textures ([`crate::table`]). Colours are computed in linear light and blended premultiplied, with four samples per
//! pixel and a depth buffer. What changes rarely (chosen vertices, styles, a heat map) is written when it changes.
//!
//! Order: background, opaque mesh, slice, translucent mesh, floor, edges, cage (first what is behind the mesh, fainter),
//! controls inside, handles, marks, gizmo.
//!
//! **Format of the target.** sRGB formats (`rgba8unorm-srgb`) are written in linear light and encoded by the GPU. A
//! canvas has none: configure it with its preferred format and the sRGB one among `view_formats`, and draw into a view
//! of the latter. Where that is not possible, any 8-bit format does: shaders then encode, and only blending differs a
//! little.

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
mod slice;
mod texture;
mod theme;

pub use camera::{AxisView, Camera, Projected, Projection, Ray};
pub use frame::{Renderer, Target};
pub use gizmo::{GIZMO_PX, pick_gizmo};
pub use layers::check_layers;
pub use model::{Alpha, DrawGroup, DrawModel, DrawTexture, DrawVertex, Wrap};
pub use part::PartPainter;
pub use scene::{Gizmo, GizmoMode, GizmoPart, Marks, MeshStyle, SceneOptions, Selection, SliceView, Theme};
pub(crate) use theme::divide_by_alpha;
