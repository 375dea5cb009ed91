//! Writes OBJ files: patches of the original file, new files, and cages.

use std::collections::HashMap;
use std::fmt::Write as _;

use cagework_core::PolygonMesh;
use glam::{DVec3, Vec3};

use super::lex::{lines, tokens};
use super::read::{MIN_CORNERS, NONE, PolygonDocument};
use crate::normals::Shading;
use crate::origin::Coordinate;
use crate::surface::{gradients, turned_normal};

/// Distinct pairs (vertex, normal) at the corners of a file; at corners without normal, pairs (vertex, smooth surface).
pub(crate) struct Pairs {
    /// The pairs as shading vertices.
    pub(crate) shading: Shading,
    /// Index of the pair at each corner of the file's faces. `[n_corners]`
    pub(crate) of_corner: Vec<u32>,
    /// Index of the `vn` line of each pair, or [`NONE`].
    pub(crate) vn: Vec<u32>,
}

impl Pairs {
    /// Normals of the pairs after the vertices have moved from `rest` to `positions`.
    fn normals(&self, rest: &[Vec3], positions: &[Vec3]) -> Vec<Vec3> {
        let Shading { vertex, normal, triangles, .. } = &self.shading;
        let [from, to] =
            [rest, positions].map(|at| vertex.iter().map(|&v| at[v as usize]).collect::<Vec<_>>());
        let gradients = gradients(&from, &to, triangles.clone());
        gradients.into_iter().zip(normal).map(|(gradient, &n)| turned_normal(gradient, n)).collect()
    }
}

impl PolygonDocument {
    /// Collects the pairs in the order of their first use. `rest`: positions of the vertices at rest.
    pub(crate) fn pairs(&self, rest: &[Vec3]) -> Pairs {
        let mut numbers = HashMap::new();
        let (mut vertex, mut vn, mut normal, mut surface) = (vec![], vec![], vec![], vec![]);
        let of_corner: Vec<u32> = self
            .corners
            .iter()
            .zip(self.surfaces())
            .map(|(c, s)| {
                *numbers.entry((c.v, c.vn, s)).or_insert_with(|| {
                    vertex.push(c.v);
                    vn.push(c.vn);
                    normal.push(self.normal(c));
                    surface.push(s);
                    vertex.len() as u32 - 1
                })
            })
            .collect();
        let triangles = self.triangles.iter().map(|t| t.map(|c| of_corner[c as usize])).collect();
        Pairs { shading: Shading::new(rest, vertex, normal, &surface, triangles), of_corner, vn }
    }
}

/// Patches the original file with new positions, relative to `origin`: changed coordinates and all normals
/// are replaced; comments, vertex colours, materials, groups and line ends stay byte for byte.
///
/// Corners that share a normal at rest may need different normals afterwards, so each `vn` line becomes one
/// line per vertex that uses it. Normal indices of faces are rewritten only if this changes the numbering. A
/// file without `vn` lines gets none.
pub(crate) fn patch(document: &PolygonDocument, rest: &[Vec3], positions: &[Vec3], origin: DVec3) -> Vec<u8> {
    let normals = (!document.normals.is_empty()).then(|| PatchedNormals::new(document, rest, positions));
    let bytes = &document.bytes;
    let mut out = Vec::with_capacity(bytes.len() + bytes.len() / 4);
    let (mut v, mut vn, mut corner) = (0, 0, 0);
    for line in lines(bytes) {
        let mut copied = line.range.start;
        let mut words = tokens(bytes, line.range.clone());
        let keyword = words.next().map_or(&b""[..], |k| &bytes[k]);
        match (keyword, &normals) {
            (b"v", _) => {
                for (token, x) in words.by_ref().take(3).zip(Coordinate::of(origin, positions[v])) {
                    if x.is(&bytes[token.clone()]) {
                        continue;
                    }
                    out.extend_from_slice(&bytes[copied..token.start]);
                    out.extend_from_slice(x.to_string().as_bytes());
                    copied = token.end;
                }
                v += 1;
            }
            (b"vn", Some(normals)) => {
                if normals.write_line(vn, line_end(&bytes[line.range.clone()]), &mut out) {
                    copied = line.range.end;
                }
                vn += 1;
            }
            (b"f" | b"fo", Some(normals)) if words.clone().count() >= MIN_CORNERS => {
                for token in words {
                    let pair = normals.of_corner[corner];
                    corner += 1;
                    if normals.renumbered && normals.line_of_pair[pair as usize] != 0 {
                        let slash = bytes[token.clone()].iter().rposition(|&b| b == b'/').unwrap_or(0);
                        out.extend_from_slice(&bytes[copied..=token.start + slash]);
                        out.extend_from_slice(normals.line_of_pair[pair as usize].to_string().as_bytes());
                        copied = token.end;
                    }
                }
            }
            _ => {}
        }
        out.extend_from_slice(&bytes[copied..line.range.end]);
    }
    out
}

struct PatchedNormals {
    /// For each `vn` line, the normals that replace it.
    lines: Vec<Vec<Vec3>>,
    of_corner: Vec<u32>,
    /// For each pair, the number from 1 of its new `vn` line; 0 if it has no normal.
    line_of_pair: Vec<u32>,
    renumbered: bool,
}

impl PatchedNormals {
    fn new(document: &PolygonDocument, rest: &[Vec3], positions: &[Vec3]) -> Self {
        let pairs = document.pairs(rest);
        let new = pairs.normals(rest, positions);
        let mut users: Vec<Vec<u32>> = vec![Vec::new(); document.normals.len()];
        for (pair, &vn) in pairs.vn.iter().enumerate() {
            if vn != NONE {
                users[vn as usize].push(pair as u32);
            }
        }
        let mut line_of_pair = vec![0; pairs.vn.len()];
        let mut next = 1;
        for users in &users {
            for (k, &pair) in users.iter().enumerate() {
                line_of_pair[pair as usize] = next + k as u32;
            }
            // Unused `vn` lines are kept, so that the numbers of later lines do not change.
            next += users.len().max(1) as u32;
        }
        Self {
            renumbered: users.iter().any(|u| u.len() > 1),
            lines: users.iter().map(|u| u.iter().map(|&p| new[p as usize]).collect()).collect(),
            of_corner: pairs.of_corner,
            line_of_pair,
        }
    }

    /// Writes the replacement of a `vn` line. Returns false if the line has no replacement and stays unchanged.
    fn write_line(&self, vn: usize, end: &[u8], out: &mut Vec<u8>) -> bool {
        for n in &self.lines[vn] {
            out.extend_from_slice(format!("vn {} {} {}", n.x, n.y, n.z).as_bytes());
            out.extend_from_slice(end);
        }
        !self.lines[vn].is_empty()
    }
}

/// Returns the line end as read. A last line without a line end gets LF.
fn line_end(line: &[u8]) -> &[u8] {
    match line {
        [.., b'\r', b'\n'] => b"\r\n",
        [.., b'\r'] => b"\r",
        _ => b"\n",
    }
}

/// A group of a new OBJ file: contiguous vertices from `start` and their faces.
pub(crate) struct ObjGroup {
    /// Name in the group's `o` line.
    pub(crate) name: String,
    /// Material in the group's `usemtl` line, if any.
    pub(crate) material: Option<String>,
    /// Index of the first vertex.
    pub(crate) start: u32,
    /// Texture coordinates per vertex, v upwards; may be empty.
    pub(crate) texcoords: Vec<[f32; 2]>,
    /// Normals per vertex; may be empty.
    pub(crate) normals: Vec<Vec3>,
    /// Indices of model vertices.
    pub(crate) triangles: Vec<[u32; 3]>,
}

/// Writes a new OBJ file: all vertices in the model's order, then the groups.
pub(crate) fn write_new(positions: &[Vec3], origin: DVec3, parts: &[ObjGroup]) -> Vec<u8> {
    let mut text = String::with_capacity(64 * positions.len());
    for p in positions {
        let [x, y, z] = Coordinate::of(origin, *p);
        line(&mut text, format_args!("v {x} {y} {z}"));
    }
    let (mut n_vt, mut n_vn) = (0_u32, 0_u32);
    for part in parts {
        line(&mut text, format_args!("o {}", one_line(&part.name)));
        if let Some(material) = &part.material {
            line(&mut text, format_args!("usemtl {}", one_line(material)));
        }
        for [u, v] in &part.texcoords {
            line(&mut text, format_args!("vt {u} {v}"));
        }
        for n in &part.normals {
            line(&mut text, format_args!("vn {} {} {}", n.x, n.y, n.z));
        }
        for t in &part.triangles {
            text.push('f');
            for &v in t {
                let local = v - part.start + 1;
                let (vt, vn) = (n_vt + local, n_vn + local);
                let written = match (part.texcoords.is_empty(), part.normals.is_empty()) {
                    (true, true) => write!(text, " {}", v + 1),
                    (false, true) => write!(text, " {}/{vt}", v + 1),
                    (true, false) => write!(text, " {}//{vn}", v + 1),
                    (false, false) => write!(text, " {}/{vt}/{vn}", v + 1),
                };
                written.expect("a String takes all text");
            }
            text.push('\n');
        }
        n_vt += part.texcoords.len() as u32;
        n_vn += part.normals.len() as u32;
    }
    text.into_bytes()
}

/// Writes a cage as an OBJ file, vertices and polygons in order. `cage`: positions relative to `origin`.
#[must_use]
pub fn write_cage_obj(cage: &PolygonMesh, origin: DVec3) -> Vec<u8> {
    let mut text = String::with_capacity(64 * cage.positions.len());
    for p in &cage.positions {
        let [x, y, z] = Coordinate::of(origin, *p);
        line(&mut text, format_args!("v {x} {y} {z}"));
    }
    for face in &cage.faces {
        text.push('f');
        for &v in face {
            write!(text, " {}", u64::from(v) + 1).expect("a String takes all text");
        }
        text.push('\n');
    }
    text.into_bytes()
}

fn line(text: &mut String, content: std::fmt::Arguments<'_>) {
    text.write_fmt(content).expect("a String takes all text");
    text.push('\n');
}

/// Puts a name on one line: replaces control characters by spaces.
fn one_line(name: &str) -> String {
    name.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}
