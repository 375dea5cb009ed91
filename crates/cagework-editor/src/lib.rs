//! Editing of models, cage, pose and saved poses: one [`Document`], changed by [`Command`]s, with undo.
//!
//! The crate needs neither a GPU nor a browser. Weights, checks and pictures are derived from a document and not part
//! of it.

pub mod cache;
mod command;
mod controls;
mod document;
pub mod edit;
mod editor;
mod error;
mod history;
mod models;
mod options;
pub mod rest_edit;
mod settings;
mod surface;
mod view;

pub use cache::Cache;
pub use command::{Command, RestEdit};
pub use controls::{CageControls, InnerKind, RestCage};
pub use document::{Document, Key, NamedPose, Transition};
pub use editor::{Contents, Editor};
pub use error::EditError;
pub use history::HISTORY_BYTES;
pub use models::{Member, MemberSettings, Models, NewModel, PartOptions};
pub use options::{BRUSH, PROPORTIONAL_RADIUS, Tools};
pub use settings::DocumentSettings;
pub use surface::SurfacePoint;
pub use view::{DocumentView, PoseView, SelectionView};
