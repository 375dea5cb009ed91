//! Editing of models, cage, pose and saved poses: one [`Document`], changed by [`Command`]s, with undo.
//!
//! The crate needs neither a GPU nor a browser. Weights, checks and pictures are derived from a document and not part
//! of it.

mod bound;
pub mod cache;
mod carry;
mod command;
mod controls;
mod document;
pub mod edit;
mod editor;
mod error;
mod export;
mod history;
mod humanoid;
mod info;
mod joints;
mod models;
mod options;
mod page_options;
mod playback;
mod posed;
mod proportions;
pub mod rest_edit;
mod settings;
mod surface;
mod view;
mod walk;
mod watch;

pub use bound::{BoundDocument, BoundError, BoundModels, KnownGround};
pub use cache::Cache;
pub use carry::carry_poses;
pub use command::{Command, RestEdit};
pub use controls::{CageControls, InnerKind, RestCage};
pub use document::{Document, Key, NamedPose, Transition};
pub use editor::{Contents, Editor};
pub use error::EditError;
pub use export::Exported;
pub use history::HISTORY_BYTES;
pub use humanoid::{BoneView, HumanoidInfo};
pub use info::{CageState, ModelInfo, up_of_capture};
pub use joints::JointDots;
pub use models::{Member, MemberSettings, Models, NewModel, PartOptions};
pub use options::{BRUSH, PROPORTIONAL_RADIUS, RigOptions, Tools};
pub use page_options::{NUMBERS, PageBindOptions, Settings, fields};
pub use playback::{Playback, SharedClip};
pub use posed::{Brush, Grab, PosedModels};
pub use proportions::FoldSample;
pub use settings::{DocumentSettings, PoseSettings};
pub use surface::SurfacePoint;
pub use view::{DocumentView, PoseView, SelectionView};
pub use walk::WalkInfo;
pub use watch::CageWatch;
