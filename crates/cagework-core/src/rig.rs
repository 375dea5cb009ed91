//! Joints of a rigged model at rest, and their influences on its vertices.

use glam::{DQuat, DVec3, Vec3};

/// A joint of a rigged model, at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Name in the file.
    pub name: String,
    /// Index of the parent joint.
    pub parent: Option<u32>,
    /// Position at rest, object units.
    pub at: Vec3,
    /// Humanoid bone that the file's VRM data gives the joint, such as "leftUpperLeg".
    pub bone: Option<String>,
}

/// A joint at one time of a clip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointFrame {
    /// Position, object units.
    pub at: DVec3,
    /// Rotation from the rest pose, in the axes of the model.
    pub turn: DQuat,
}

/// The joints of a rigged model and their influences on its vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rig {
    /// All joints.
    pub joints: Vec<Joint>,
    /// Start of each vertex's influences in `influences`; the last element is their number. `[n_vertices + 1]`
    pub first: Vec<u32>,
    /// Joint and weight of each influence. Rigid vertices have one influence, the joint on which they hang.
    pub influences: Vec<(u32, f32)>,
}

impl Rig {
    /// Appends the vertices of another model. Its joints are added; those with the name of an earlier model's joint are
    /// that joint. `rig`: rig of the other model. `n_vertices`: number of vertices to append; those beyond the rig's have
    /// no influences.
    pub fn append(&mut self, rig: Option<&Self>, n_vertices: usize) {
        if self.first.is_empty() {
            self.first.push(0);
        }
        let n = self.first.len() + n_vertices;
        if let Some(rig) = rig {
            let n_joints = self.joints.len();
            let mut number = Vec::with_capacity(rig.joints.len());
            for joint in &rig.joints {
                let same = self.joints[..n_joints].iter().position(|other| other.name == joint.name);
                number.push(same.unwrap_or(self.joints.len()) as u32);
                if same.is_none() {
                    self.joints.push(joint.clone());
                }
            }
            for (joint, &own) in rig.joints.iter().zip(&number) {
                if own as usize >= n_joints {
                    let parent =
                        joint.parent.map(|parent| number.get(parent as usize).copied().unwrap_or(parent));
                    self.joints[own as usize].parent = parent;
                }
            }
            let base = self.influences.len() as u32;
            let renumbered = rig
                .influences
                .iter()
                .map(|&(joint, weight)| (number.get(joint as usize).copied().unwrap_or(u32::MAX), weight));
            self.influences.extend(renumbered);
            self.first.extend(rig.first.iter().skip(1).map(|&first| base + first));
        }
        self.first.resize(n, self.influences.len() as u32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rig(names: &[(&str, Option<u32>)], influences: &[(u32, f32)]) -> Rig {
        let joint = |(name, parent): &(&str, _)| Joint {
            name: (*name).into(),
            parent: *parent,
            at: Vec3::ZERO,
            bone: None,
        };
        Rig {
            joints: names.iter().map(joint).collect(),
            first: (0..=influences.len() as u32).collect(),
            influences: influences.to_vec(),
        }
    }

    #[test]
    fn joints_of_the_same_name_are_one_joint() {
        let body = rig(&[("hips", None), ("leg", Some(0))], &[(0, 1.0), (1, 0.5)]);
        let boot = rig(&[("buckle", Some(1)), ("leg", None)], &[(1, 0.75), (0, 0.25)]);
        let mut all = Rig::default();
        all.append(Some(&body), 2);
        all.append(None, 1);
        all.append(Some(&boot), 3);
        let names: Vec<_> = all.joints.iter().map(|joint| (joint.name.as_str(), joint.parent)).collect();
        assert_eq!(names, [("hips", None), ("leg", Some(0)), ("buckle", Some(1))]);
        assert_eq!(all.influences, [(0, 1.0), (1, 0.5), (1, 0.75), (2, 0.25)]);
        // Vertices: two of the body, one without a rig, two of the boot and one beyond them.
        assert_eq!(all.first, [0, 1, 2, 2, 3, 4, 4]);
    }
}
