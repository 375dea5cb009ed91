//! Targets of animation channels.

use serde_json::Value;

/// Property that an animation channel animates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ChannelTarget {
    Translation(usize),
    Rotation(usize),
    Scale(usize),
    /// Morph weights of a node.
    Weights(usize),
    MeshWeights(usize),
}

/// Reads the target of a channel, by `path` and node or by KHR_animation_pointer. `None` if unsupported.
pub(super) fn channel_target(channel: &Value) -> Option<ChannelTarget> {
    let target = &channel["target"];
    if let Some(pointer) = target.pointer("/extensions/KHR_animation_pointer/pointer").and_then(Value::as_str)
    {
        let mut words = pointer.strip_prefix('/')?.split('/');
        let (list, index, what) = (words.next()?, words.next()?.parse().ok()?, words.next()?);
        return match (list, what, words.next()) {
            ("nodes", "translation", None) => Some(ChannelTarget::Translation(index)),
            ("nodes", "rotation", None) => Some(ChannelTarget::Rotation(index)),
            ("nodes", "scale", None) => Some(ChannelTarget::Scale(index)),
            ("nodes", "weights", None) => Some(ChannelTarget::Weights(index)),
            ("meshes", "weights", None) => Some(ChannelTarget::MeshWeights(index)),
            _ => None,
        };
    }
    let node = target["node"].as_u64()? as usize;
    match target["path"].as_str()? {
        "translation" => Some(ChannelTarget::Translation(node)),
        "rotation" => Some(ChannelTarget::Rotation(node)),
        "scale" => Some(ChannelTarget::Scale(node)),
        "weights" => Some(ChannelTarget::Weights(node)),
        _ => None,
    }
}
