//! Linear blend skinning and morph targets, for playing animation clips.

use glam::{Mat4, Quat, Vec3};

/// Vertices with joint weights and morph targets, in compressed rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Skin {
    /// Rest positions in mesh space, without morph targets. `[n_vertices]`
    pub positions: Vec<Vec3>,
    /// First entry of each vertex in `joints`. `[n_vertices + 1]`
    pub joint_starts: Vec<u32>,
    /// Index into the palette of [`skin_vertices`], and weight. The weights of a vertex sum to 1.
    pub joints: Vec<(u32, f32)>,
    /// First entry of each vertex in `deltas`. `[n_vertices + 1]`
    pub delta_starts: Vec<u32>,
    /// `(target, displacement at weight 1)`, in mesh space.
    pub deltas: Vec<(u32, Vec3)>,
}

/// A skeleton with an animation clip. In the rest pose, the axes of all joints are parallel to the model's.
#[derive(Clone, Debug)]
pub struct Rig {
    /// Joints, parents before children, the root first.
    pub joints: Vec<Joint>,
    /// Four joints of each vertex with their weights. `[n_vertices]`
    pub influences: Vec<[(u32, f32); 4]>,
    /// Name of the clip.
    pub clip: &'static str,
    /// Times of the clip's keyframes, seconds, ascending. `[n_keys]`
    pub times: Vec<f32>,
    /// Rotation of each joint relative to its rest pose. `[n_joints, n_keys]`
    pub turns: Vec<Vec<Quat>>,
    /// Position of the root, object units. `[n_keys]`
    pub root: Vec<Vec3>,
}

/// A joint of the skeleton of a [`Rig`].
#[derive(Clone, Copy, Debug)]
pub struct Joint {
    /// Name of the joint's node in exported files.
    pub name: &'static str,
    /// Rest position, object units.
    pub at: Vec3,
    /// Index of the parent; `None` for the root.
    pub parent: Option<usize>,
}

impl Skin {
    /// The skin with copies of the given vertices appended.
    #[must_use]
    pub fn with_copies(&self, copies: &[u32]) -> Self {
        let mut all = self.clone();
        all.append(self, copies);
        all
    }

    /// The skin of the given vertices alone.
    #[must_use]
    pub fn of_vertices(&self, vertices: &[u32]) -> Self {
        let mut own = Self { joint_starts: vec![0], delta_starts: vec![0], ..Self::default() };
        own.append(self, vertices);
        own
    }

    fn append(&mut self, from: &Self, vertices: &[u32]) {
        for &v in vertices {
            let v = v as usize;
            let [joints, deltas] = [&from.joint_starts, &from.delta_starts]
                .map(|starts| starts[v] as usize..starts[v + 1] as usize);
            self.positions.push(from.positions[v]);
            self.joints.extend_from_slice(&from.joints[joints]);
            self.deltas.extend_from_slice(&from.deltas[deltas]);
            self.joint_starts.push(self.joints.len() as u32);
            self.delta_starts.push(self.deltas.len() as u32);
        }
    }
}

/// Positions of all vertices: `sum_j w_j M_j (p + sum_k t_k d_k)` (glTF 2.0, sections 3.7.2.2 and 3.7.3.3), with the
/// joint matrices `M_j`, target weights `t_k` and displacements `d_k`.
///
/// `palette`: for each joint, the matrix from mesh space to world space. `targets`: weights of the morph targets.
/// Returns `[n_vertices]`.
///
/// # Panics
/// If a joint or target index is out of range.
#[must_use]
pub fn skin_vertices(skin: &Skin, palette: &[Mat4], targets: &[f32]) -> Vec<Vec3> {
    let range = |starts: &[u32], v: usize| starts[v] as usize..starts[v + 1] as usize;
    let vertex = |(v, &rest): (usize, &Vec3)| {
        let deltas = &skin.deltas[range(&skin.delta_starts, v)];
        let p = deltas.iter().fold(rest, |p, &(target, delta)| p + targets[target as usize] * delta);
        let joints = &skin.joints[range(&skin.joint_starts, v)];
        joints.iter().fold(Vec3::ZERO, |sum, &(joint, weight)| {
            sum + weight * palette[joint as usize].transform_point3(p)
        })
    };
    skin.positions.iter().enumerate().map(vertex).collect()
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;

    #[test]
    fn vertices_blend_joints_after_their_targets() {
        let skin = Skin {
            positions: vec![Vec3::X, Vec3::Y],
            joint_starts: vec![0, 1, 3],
            joints: vec![(1, 1.0), (0, 0.25), (1, 0.75)],
            delta_starts: vec![0, 2, 2],
            deltas: vec![(0, Vec3::Z), (1, Vec3::X)],
        };
        let turn = Mat4::from_quat(Quat::from_rotation_z(std::f32::consts::FRAC_PI_2));
        let palette = [Mat4::from_translation(Vec3::splat(4.0)), turn];
        let posed = skin_vertices(&skin, &palette, &[0.5, 1.0]);
        // Vertex 0: (2, 0, 0.5) rotated by 90 degrees about z. Vertex 1: a quarter of (4, 5, 4) plus three quarters of
        // (-1, 0, 0).
        let copied = skin_vertices(&skin.with_copies(&[1, 0]), &palette, &[0.5, 1.0]);
        assert_eq!(copied, [posed[0], posed[1], posed[1], posed[0]]);
        assert!(posed[0].distance(Vec3::new(0.0, 2.0, 0.5)) < 1e-6, "{}", posed[0]);
        assert!(posed[1].distance(Vec3::new(0.25, 1.25, 1.0)) < 1e-6, "{}", posed[1]);
    }
}
