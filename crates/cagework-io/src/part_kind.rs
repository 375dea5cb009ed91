//! Kinds of the parts of a model that are selected by name.

/// Kind of part that a name refers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PartKind {
    /// A material: the vertices of the faces that use it.
    Material,
    /// A glTF node with its descendants.
    Node,
    /// A glTF joint: the vertices on which it has the largest weight. Other programs call this a vertex group.
    Joint,
    /// An object or group of an OBJ, started by an `o` or `g` line.
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
