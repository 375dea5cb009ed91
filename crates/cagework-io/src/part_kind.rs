//! What parts of a model have names.

/// What a name can be the name of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PartKind {
    /// A material.
    Material,
    /// A node of a glTF, with all that hangs below it.
    Node,
    /// A joint of a glTF: the vertices that it holds more than any other does. A vertex group, elsewhere.
    Joint,
    /// An `o` or `g` line of an OBJ.
    Group,
}

impl PartKind {
    pub(crate) const ALL: [Self; 4] = [Self::Material, Self::Node, Self::Joint, Self::Group];

    /// The word before a name, as in `material:skin`.
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
