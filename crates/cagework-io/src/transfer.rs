//! Joint weights of a body for clothes.

use std::borrow::Cow;

use cagework_core::inpaint::{Inpainted, REACH, inpaint};
use cagework_core::words::counted;
use thiserror::Error;

use crate::error::WriteError;
use crate::gltf;
use crate::memory::MemoryError;
use crate::model::{Document, Model, ReadError};
use crate::shown::shown;

/// Error of [`Model::write_with_skin_of`].
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum TransferError {
    /// The body has no joint weights.
    #[error("{} has no skin: take a body with a skeleton and joint weights (.glb, .gltf or .vrm)", shown(.0))]
    NoSkin(String),
    /// The clothes have a skin.
    #[error("{} has a skin already: export the clothes without a skeleton", shown(.0))]
    HasSkin(String),
    /// No vertex is near the body.
    #[error(
        "no vertex of {} is near the body and faces the same way (distance at most {REACH} of the body's diagonal, angle at \
         most 30 degrees): give both files the same units, axes and pose, and faces that point outwards",
        shown(.0)
    )]
    Far(String),
    /// The weights exceed the memory limit.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// A file cannot be converted to a GLB.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The clothes cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

impl Model {
    /// These clothes as a GLB with the joints of `body` and weights copied from it, at most four per vertex. Both models
    /// must be in the same pose and space. The second value counts positions; its `values` are the weights of all joints.
    ///
    /// # Errors
    /// [`TransferError`] if the body has no skin, the clothes have one or are not near the body, or if the weights need more
    /// than `memory_limit` bytes.
    pub fn write_with_skin_of(
        &self,
        body: &Self,
        memory_limit: u64,
    ) -> Result<(Vec<u8>, Inpainted), TransferError> {
        let mut clothes = self.as_gltf()?.into_owned();
        clothes.see_from(body.origin);
        let no_skin = || TransferError::NoSkin(body.name.clone());
        let (Document::Gltf(skeleton), Some(player)) = (&body.document, body.player()?) else {
            return Err(no_skin());
        };
        let Document::Gltf(document) = &clothes.document else { return Err(WriteError::NoRig.into()) };
        if clothes.counts.skins > 0 {
            return Err(TransferError::HasSkin(self.name.clone()));
        }
        let (skin, nodes) = (&player.skin, player.palette_nodes());
        let mut joints: Vec<u32> =
            skin.joints.iter().filter_map(|&(entry, _)| nodes[entry as usize]).collect();
        joints.sort_unstable();
        joints.dedup();
        let n = joints.len();
        if body.counts.skins == 0 || n == 0 {
            return Err(no_skin());
        }
        // Weights of the body; weights of the clothes, twice.
        let rows = body.positions.len() + 2 * clothes.positions.len();
        MemoryError::check(4 * (rows as u64).saturating_mul(n as u64), memory_limit)?;
        let mut weights = vec![0.0; n * body.positions.len()];
        for (v, range) in skin.joint_starts.windows(2).enumerate() {
            for &(entry, weight) in &skin.joints[range[0] as usize..range[1] as usize] {
                let column = nodes[entry as usize].and_then(|node| joints.binary_search(&node).ok());
                column.into_iter().for_each(|column| weights[v * n + column] += weight);
            }
        }
        let found = inpaint(&body.tri_mesh(), &weights, n, &clothes.tri_mesh());
        if found.matched == 0 {
            return Err(TransferError::Far(self.name.clone()));
        }
        Ok((gltf::write_skinned(document, skeleton, (&joints, &found.values))?, found))
    }

    /// Like [`Self::write_with_skin_of`], as a model with the positions, up axis and origin of this one. Its name ends in
    /// `.glb` if the clothes are not a glTF, and its vertices then are in the order of the GLB.
    ///
    /// # Errors
    /// As [`Self::write_with_skin_of`].
    pub fn with_skin_of(&self, body: &Self, memory_limit: u64) -> Result<(Self, Inpainted), TransferError> {
        let (glb, found) = self.write_with_skin_of(body, memory_limit)?;
        let clothes = self.as_gltf()?;
        let mut model = Self::read_within(&clothes.name, glb, &mut |_| None, memory_limit)?;
        model.set_up(self.up);
        model.see_from(self.origin);
        // Skinning at rest rounds the positions.
        model.positions.clone_from(&clothes.positions);
        Ok((model, found))
    }

    /// This model as a glTF.
    fn as_gltf(&self) -> Result<Cow<'_, Self>, TransferError> {
        if matches!(self.document, Document::Gltf(_)) {
            return Ok(Cow::Borrowed(self));
        }
        let stem = self.name.rsplit_once('.').map_or(self.name.as_str(), |(stem, _)| stem);
        let mut model = Self::read(&format!("{stem}.glb"), &self.write_glb(&self.positions)?, &mut |_| None)?;
        model.set_up(self.up);
        model.see_from(self.origin);
        Ok(Cow::Owned(model))
    }
}

/// How many positions of clothes got their weights in which way, a line each. Ways without positions are left out.
#[must_use]
pub fn transfer_report(found: &Inpainted) -> Vec<String> {
    let ways = [
        (found.matched, "with the weights of the body"),
        (found.inpainted, "that continue their neighbours"),
        (found.copied, "in parts away from the body, with the weights of its closest point"),
    ];
    let some = ways.into_iter().filter(|(n, _)| *n > 0);
    some.map(|(n, way)| format!("{} {way}", counted(n, "position", "positions"))).collect()
}
