//! Kinds of named parts.

/// Kind of a named part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PartKind {
    /// A material.
    Material,
    /// A glTF node with its descendants.
    Node,
    /// A glTF joint: the vertices on which it has the largest weight. Other programs call this a vertex group.
    Joint,
    /// An `o` or `g` line of an OBJ.
    Group,
}

impl PartKind {
    pub(crate) const ALL: [Self; 4] = [Self::Material, Self::Node, Self::Joint, Self::Group];

    /// Prefix of qualified names, as in `material:skin`.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Material => "material",
            Self::Node => "node",
            Self::Joint => "joint",
            Self::Group => "group",
        }
    }
}
