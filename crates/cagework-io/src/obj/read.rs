//! Reads an OBJ file: one vertex per `v` line, one polygon per `f` line, in file order.

use cagework_core::words::counted;
use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use super::error::ObjError;
use super::lex::{Line, lines, shown, tokens};
use super::look::{Material, libraries_of, read_materials, rest_of};
use super::triangulate::Triangulator;
use crate::memory::{MemoryError, WELD_BYTES};
use crate::origin::relative;
use crate::shown::{MAX_NAME_CHARS, shown_start};
use crate::siblings::{Resolve, SiblingError, Siblings};

/// Value of a missing index, such as the normal of a corner without a normal.
pub(crate) const NONE: u32 = u32::MAX;

/// Corner of a face. Indices from 0; `vt` and `vn` may be [`NONE`].
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Pod, Zeroable)]
pub(crate) struct Corner {
    pub(crate) v: u32,
    pub(crate) vt: u32,
    pub(crate) vn: u32,
}

/// An `o` or `g` line. An `o` line applies to all faces up to the next `o` line, a `g` line up to the next `g` line.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Group {
    pub(crate) is_object: bool,
    /// Text after the keyword. A `g` line can contain several names.
    pub(crate) name: String,
    /// Index of the first face after the line.
    pub(crate) first_face: u32,
}

impl Group {
    pub(super) fn is_called(&self, name: &str) -> bool {
        self.name == name || (!self.is_object && self.name.split_whitespace().any(|one| one == name))
    }
}

/// A polygon mesh with what exports need of its file: an OBJ, PLY, STL, OFF or 3MF. Of a capture, the points.
#[derive(Clone, Debug, Default)]
pub(crate) struct PolygonDocument {
    /// Bytes of the original file if it is an OBJ or a 3MF; otherwise empty.
    pub(crate) bytes: Vec<u8>,
    /// `vt` lines as written, v upwards.
    pub(crate) texcoords: Vec<[f32; 2]>,
    /// Unit normals of `vn` lines; zero if unreadable.
    pub(crate) normals: Vec<Vec3>,
    /// Corners of all faces, concatenated.
    pub(crate) corners: Vec<Corner>,
    /// Start of each face in `corners`. `[n_faces + 1]`
    pub(crate) face_starts: Vec<u32>,
    /// Material of each face, an index into `materials`, or [`NONE`].
    pub(crate) face_materials: Vec<u32>,
    /// Smoothing group of each face, 0 for none. Empty if the file has no `s` line.
    pub(crate) face_smoothing: Vec<u32>,
    /// Names after `usemtl`, in order of first use.
    pub(crate) materials: Vec<String>,
    /// `o` and `g` lines, without repetitions of the current name.
    pub(crate) groups: Vec<Group>,
    /// Triangles, indices into `corners`.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Materials of the `.mtl` files that were found, by name.
    pub(crate) looks: HashMap<String, Material>,
    /// Vertex colours that follow the coordinates of `v` lines, by vertex; sRGB, not converted.
    pub(crate) colors: HashMap<u32, [f32; 3]>,
}

impl PolygonDocument {
    /// Vertices of each face.
    pub(crate) fn faces(&self) -> impl ExactSizeIterator<Item = Vec<u32>> {
        let corners = |ends: &[u32]| &self.corners[ends[0] as usize..ends[1] as usize];
        self.face_starts.windows(2).map(move |ends| corners(ends).iter().map(|c| c.v).collect())
    }

    /// Normal of a corner; zero if the corner has no normal.
    pub(crate) fn normal(&self, corner: &Corner) -> Vec3 {
        self.normals.get(corner.vn as usize).copied().unwrap_or(Vec3::ZERO)
    }

    /// Returns the smooth surface of each corner without normal, numbered from 1: its smoothing group or, with
    /// smoothing off, its face. 0 for corners with a normal, or if the file has no `s` line. `[n_corners]`
    pub(crate) fn surfaces(&self) -> Vec<u32> {
        let mut surfaces = vec![0; self.corners.len()];
        let mut first_face = HashMap::new();
        for ((face, ends), &group) in (1..).zip(self.face_starts.windows(2)).zip(&self.face_smoothing) {
            let surface = if group == 0 { face } else { *first_face.entry(group).or_insert(face) };
            let corners = ends[0] as usize..ends[1] as usize;
            for (of_corner, corner) in surfaces[corners.clone()].iter_mut().zip(&self.corners[corners]) {
                if self.normal(corner) == Vec3::ZERO {
                    *of_corner = surface;
                }
            }
        }
        surfaces
    }

    /// Triangulates all faces. Returns the number of concave faces that were split into fans because the work limit was
    /// reached.
    pub(crate) fn triangulate(&mut self, positions: &[Vec3]) -> usize {
        let mut triangulator = Triangulator::new();
        let mut polygon = Vec::new();
        let n_faces = self.face_starts.len().saturating_sub(1);
        self.triangles.reserve_exact(self.corners.len().saturating_sub(2 * n_faces));
        for face in self.face_starts.windows(2) {
            let corners = &self.corners[face[0] as usize..face[1] as usize];
            polygon.clear();
            polygon.extend(corners.iter().map(|c| positions[c.v as usize]));
            triangulator.triangulate(&polygon, face[0], &mut self.triangles);
        }
        triangulator.fans
    }

    /// Triangles (indices of corners) of each material, in order of first use.
    pub(crate) fn by_material(&self) -> Vec<(u32, Vec<[u32; 3]>)> {
        let mut groups: Vec<(u32, Vec<[u32; 3]>)> = Vec::new();
        let mut group_of = HashMap::new();
        let mut face = 0;
        for t in &self.triangles {
            // Triangles are in the order of the faces, whose corners are contiguous: advance to the face of this
            // triangle.
            while self.face_starts[face + 1] <= t[0] {
                face += 1;
            }
            let material = self.face_materials[face];
            let group = *group_of.entry(material).or_insert_with(|| {
                groups.push((material, Vec::new()));
                groups.len() - 1
            });
            groups[group].1.push(*t);
        }
        groups
    }
}

/// Result of reading an OBJ file.
pub(crate) struct ObjModel {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) document: PolygonDocument,
    /// Total number of `o` and `g` lines.
    pub(crate) groups: usize,
    /// Approximate memory of the document, bytes.
    pub(crate) bytes: u64,
    pub(crate) notices: Vec<String>,
}

struct Reader<'a> {
    bytes: &'a [u8],
    /// Memory of the file's bytes: the size of the file, or twice the size if the document copies borrowed bytes.
    file_memory: u64,
    positions: Vec<Vec3>,
    document: PolygonDocument,
    material_numbers: HashMap<&'a [u8], u32>,
    material: u32,
    /// Smoothing group of the following faces. 0, the default of the format, means none.
    smoothing: u32,
    has_smoothing: bool,
    /// References to vertices that have not been read yet: line and vertex index. They are checked at the end.
    forward: Vec<(usize, u32)>,
    groups: usize,
    group_bytes: u64,
    bad_attributes: usize,
    ignored: usize,
    siblings: Siblings<'a>,
    /// Names of the material files that were read.
    libraries: HashSet<String>,
    memory_limit: u64,
    notices: Vec<String>,
}

/// Limit on `usemtl` names. Each name becomes a draw call and a GLB primitive.
pub(crate) const MAX_MATERIALS: usize = 1 << 14;

/// Minimum number of corners of a face. Faces with fewer corners are ignored, as are lines and points.
pub(super) const MIN_CORNERS: usize = 3;

/// Limit on the corners of a face, each of which takes up to 100 bytes while a model is read and drawn.
pub(crate) const MAX_FACE_CORNERS: usize = 1 << 18;

/// Number of lines or corners after which the memory limit is checked again.
const MEMORY_CHECK_INTERVAL: usize = 1 << 12;

/// Reads an OBJ file using at most `memory_limit` bytes. `resolve` returns its material files and textures.
pub(crate) fn read(
    bytes: Cow<'_, [u8]>,
    resolve: &mut Resolve<'_>,
    memory_limit: u64,
) -> Result<ObjModel, ObjError> {
    let copies = if matches!(bytes, Cow::Owned(_)) { 1 } else { 2 };
    let mut model = read_bytes(&bytes, copies, resolve, memory_limit)?;
    model.document.bytes = bytes.into_owned();
    Ok(model)
}

fn read_bytes(
    bytes: &[u8],
    copies: u64,
    resolve: &mut Resolve<'_>,
    memory_limit: u64,
) -> Result<ObjModel, ObjError> {
    let mut reader = Reader {
        bytes,
        file_memory: copies * bytes.len() as u64,
        positions: Vec::new(),
        document: PolygonDocument { face_starts: vec![0], ..PolygonDocument::default() },
        material_numbers: HashMap::new(),
        material: NONE,
        smoothing: 0,
        has_smoothing: false,
        forward: Vec::new(),
        groups: 0,
        group_bytes: 0,
        bad_attributes: 0,
        ignored: 0,
        siblings: Siblings::new(resolve, memory_limit),
        libraries: HashSet::new(),
        memory_limit,
        notices: Vec::new(),
    };
    for (number, line) in lines(bytes).enumerate() {
        reader.line(&line)?;
        if number.is_multiple_of(MEMORY_CHECK_INTERVAL) {
            reader.check_memory()?;
        }
    }
    reader.finish()
}

/// Reads the `v` lines of a valid file again. Subtracts `origin` in double precision before rounding to f32.
pub(crate) fn positions_near(bytes: &[u8], origin: DVec3) -> Vec<Vec3> {
    let vertices = lines(bytes).filter_map(|line| {
        let mut words = tokens(bytes, line.range);
        let is_vertex = words.next().is_some_and(|keyword| &bytes[keyword] == b"v");
        let mut number = || std::str::from_utf8(&bytes[words.next()?]).ok()?.parse().ok();
        is_vertex.then(|| Some(relative(DVec3::new(number()?, number()?, number()?), origin))).flatten()
    });
    vertices.collect()
}

impl<'a> Reader<'a> {
    fn line(&mut self, line: &Line) -> Result<(), ObjError> {
        let bytes = self.bytes;
        let mut words = tokens(bytes, line.range.clone());
        let Some(keyword) = words.next() else { return Ok(()) };
        match &bytes[keyword.clone()] {
            b"v" => {
                let mut p = [0.0; 3];
                for (value, axis) in p.iter_mut().zip(['x', 'y', 'z']) {
                    let token = words.next();
                    *value = token.clone().and_then(|t| number(&bytes[t])).ok_or_else(|| {
                        let found = token.map_or("missing".into(), |t| format!("'{}'", shown(&bytes[t])));
                        ObjError::Coordinate { line: line.number, axis, found }
                    })?;
                }
                let after: Vec<f32> = words.map_while(|t| number(&bytes[t])).take(4).collect();
                // One number after the coordinates is a weight, three numbers are a colour, four a colour with its
                // opacity, which is ignored.
                if let [r, g, b] | [r, g, b, _] = after[..] {
                    self.document.colors.insert(self.positions.len() as u32, [r, g, b]);
                }
                self.positions.push(Vec3::from_array(p));
                check_count(self.positions.len(), line.number)?;
            }
            b"vt" => {
                let u = words.next().and_then(|t| number(&bytes[t]));
                // One-dimensional texture coordinates have no v.
                let v = words.next().map_or(Some(0.0), |t| number(&bytes[t]));
                self.bad_attributes += usize::from(u.is_none() || v.is_none());
                self.document.texcoords.push([u.unwrap_or(0.0), v.unwrap_or(0.0)]);
            }
            b"vn" => {
                let n: Vec<f32> = words.map_while(|t| number(&bytes[t])).take(3).collect();
                self.bad_attributes += usize::from(n.len() < 3);
                let n = if n.len() < 3 { Vec3::ZERO } else { Vec3::from_slice(&n) };
                self.document.normals.push(n.as_dvec3().normalize_or_zero().as_vec3());
            }
            b"f" | b"fo" => self.face(line.number, words)?,
            b"o" | b"g" => self.group(&bytes[line.range.clone()]),
            b"s" => {
                if let Some(group) = words.next().and_then(|t| smoothing_group(&bytes[t])) {
                    (self.smoothing, self.has_smoothing) = (group, true);
                }
            }
            b"usemtl" => self.use_material(line)?,
            b"mtllib" => self.library(&rest_of(&bytes[line.range.clone()], b"mtllib")),
            b"l" | b"p" | b"curv" | b"curv2" | b"surf" => self.ignored += 1,
            _ => {}
        }
        Ok(())
    }

    /// Estimates the memory of the data read so far, including its triangles and the weld table, and checks it against
    /// the limit. Lists count twice, because their capacity grows by doubling.
    fn check_memory(&self) -> Result<u64, MemoryError> {
        let document = &self.document;
        let lists = [
            (24 + WELD_BYTES, self.positions.len()),
            (16, document.texcoords.len()),
            (24, document.normals.len()),
            // Count one triangle per corner, stored as corner indices and as vertex indices.
            (24 + 24, document.corners.len()),
            (24, document.face_materials.len()),
            (80, document.colors.len()),
            (64, document.groups.len()),
            (32, self.forward.len()),
            (200, document.materials.len() + document.looks.len() + self.libraries.len()),
        ];
        let lists: u64 = lists.iter().map(|&(bytes, n)| bytes * n as u64).sum();
        let needed = self.file_memory + self.siblings.bytes() + self.group_bytes + lists;
        MemoryError::check(needed, self.memory_limit).map(|()| needed)
    }

    fn face(&mut self, line: usize, words: impl Iterator<Item = Range<usize>>) -> Result<(), ObjError> {
        let (start, forward) = (self.document.corners.len(), self.forward.len());
        for token in words {
            if self.document.corners.len().is_multiple_of(MEMORY_CHECK_INTERVAL) {
                self.check_memory()?;
            }
            if self.document.corners.len() - start == MAX_FACE_CORNERS {
                return Err(ObjError::FaceCorners { line, limit: MAX_FACE_CORNERS });
            }
            let token = &self.bytes[token];
            let bad = || ObjError::Corner { line, found: shown(token) };
            let mut parts = token.split(|&b| b == b'/');
            let index = parts.next().and_then(integer).ok_or_else(bad)?;
            let v = resolve(index, self.positions.len()).ok_or(ObjError::Vertex {
                line,
                index,
                vertices: self.positions.len(),
            })?;
            if v as usize >= self.positions.len() {
                self.forward.push((line, v));
            }
            let mut attribute = |count: usize| -> Result<u32, ObjError> {
                match parts.next() {
                    None | Some(b"") => Ok(NONE),
                    Some(part) => {
                        let index = integer(part).ok_or_else(bad)?;
                        Ok(resolve(index, count).unwrap_or(NONE))
                    }
                }
            };
            let vt = attribute(self.document.texcoords.len())?;
            let vn = attribute(self.document.normals.len())?;
            if parts.next().is_some() {
                return Err(bad());
            }
            self.document.corners.push(Corner { v, vt, vn });
        }
        if self.document.corners.len() - start < MIN_CORNERS {
            self.document.corners.truncate(start);
            self.forward.truncate(forward);
            self.ignored += 1;
            return Ok(());
        }
        check_count(self.document.corners.len(), line)?;
        self.document.face_starts.push(self.document.corners.len() as u32);
        self.document.face_materials.push(self.material);
        self.document.face_smoothing.push(self.smoothing);
        Ok(())
    }

    fn group(&mut self, line: &[u8]) {
        self.groups += 1;
        let line = line.trim_ascii();
        let is_object = line.starts_with(b"o");
        let name = rest_of(line, if is_object { b"o" } else { b"g" });
        let groups = &mut self.document.groups;
        if groups.iter().rev().find(|g| g.is_object == is_object).is_some_and(|g| g.name == name) {
            return;
        }
        self.group_bytes += name.len() as u64;
        groups.push(Group { is_object, name, first_face: self.document.face_materials.len() as u32 });
    }

    /// Reads the material files of a line, except those that have been read before.
    fn library(&mut self, text: &str) {
        for (name, file) in libraries_of(text, &mut self.siblings, &mut self.libraries) {
            match file {
                Ok(file) => {
                    let looks = &mut self.document.looks;
                    read_materials(&file, &mut self.siblings, &mut self.notices, looks);
                }
                Err(SiblingError::Refused(reason)) => {
                    let name = shown_start(&name, MAX_NAME_CHARS);
                    self.notices
                        .push(format!("material file '{name}' {reason}: its materials are not drawn"));
                }
                // Material files are often missing, so this causes no notice.
                Err(SiblingError::Missing) => {}
            }
        }
    }

    fn use_material(&mut self, line: &Line) -> Result<(), ObjError> {
        let text = &self.bytes[line.range.clone()];
        let name = text.trim_ascii().strip_prefix(b"usemtl").unwrap_or_default().trim_ascii();
        let materials = &mut self.document.materials;
        self.material = *self.material_numbers.entry(name).or_insert_with(|| {
            materials.push(String::from_utf8_lossy(name).into_owned());
            materials.len() as u32 - 1
        });
        if materials.len() > MAX_MATERIALS {
            return Err(ObjError::Materials { line: line.number, limit: MAX_MATERIALS });
        }
        Ok(())
    }

    fn finish(mut self) -> Result<ObjModel, ObjError> {
        let vertices = self.positions.len();
        if vertices == 0 {
            return Err(ObjError::Empty);
        }
        let reading = self.check_memory()?;
        if let Some(&(line, v)) = self.forward.iter().find(|&&(_, v)| v as usize >= vertices) {
            return Err(ObjError::Vertex { line, index: i64::from(v) + 1, vertices });
        }
        let mut dangling = 0_usize;
        let (n_vt, n_vn) = (self.document.texcoords.len(), self.document.normals.len());
        for corner in &mut self.document.corners {
            for (index, count) in [(&mut corner.vt, n_vt), (&mut corner.vn, n_vn)] {
                if *index != NONE && *index as usize >= count {
                    *index = NONE;
                    dangling += 1;
                }
            }
        }
        let fans = self.document.triangulate(&self.positions);
        if !self.has_smoothing {
            self.document.face_smoothing.clear();
        }
        let mut notices = self.notices;
        let mut notice = |n: usize, one: &str, many: &str, text: &str| {
            if n > 0 {
                notices.push(format!("{} {text}", counted(n, one, many)));
            }
        };
        notice(
            dangling,
            "face corner names a texture coordinate or normal that does",
            "face corners name texture coordinates or normals that do",
            "not exist: reference ignored",
        );
        notice(
            fans,
            "concave face has too many corners and was",
            "concave faces have too many corners and were",
            "triangulated as a fan around the first corner: split such faces for a correct shape",
        );
        notice(
            self.bad_attributes,
            "'vt' or 'vn' line is not numeric:",
            "'vt' or 'vn' lines are not numeric:",
            "read as zero",
        );
        notice(
            self.ignored,
            "line, point, curve or face with fewer than three corners",
            "lines, points, curves or faces with fewer than three corners",
            "not deformed: kept unchanged in OBJ exports",
        );
        // Subtract the memory that is freed after reading: the caller's copy of the file, and the weld table.
        let freed = self.file_memory - self.bytes.len() as u64;
        let bytes = reading - freed - WELD_BYTES * vertices as u64;
        Ok(ObjModel {
            positions: self.positions,
            document: self.document,
            groups: self.groups,
            bytes,
            notices,
        })
    }
}

pub(super) fn check_count(count: usize, line: usize) -> Result<(), ObjError> {
    if count >= NONE as usize { Err(ObjError::TooLarge { line, limit: NONE - 1 }) } else { Ok(()) }
}

/// Parses a finite number.
pub(super) fn number(token: &[u8]) -> Option<f32> {
    std::str::from_utf8(token).ok()?.parse::<f32>().ok().filter(|x| x.is_finite())
}

/// Parses a number within the f32 range with f64 precision.
pub(super) fn wide_number(token: &[u8]) -> Option<f64> {
    number(token)?;
    std::str::from_utf8(token).ok()?.parse().ok()
}

pub(super) fn integer(token: &[u8]) -> Option<i64> {
    std::str::from_utf8(token).ok()?.parse().ok()
}

/// Parses a smoothing group, 0 for `off`; `None` if it is neither a number nor `off`.
fn smoothing_group(word: &[u8]) -> Option<u32> {
    if word == b"off" { Some(0) } else { u32::try_from(integer(word)?).ok() }
}

/// Converts an index in the file to an index from 0. Positive indices count from 1, negative ones backwards from the
/// `count` elements read so far.
pub(super) fn resolve(index: i64, count: usize) -> Option<u32> {
    let from_zero = if index < 0 { i64::try_from(count).ok()?.checked_add(index)? } else { index - 1 };
    u32::try_from(from_zero).ok().filter(|&i| i != NONE)
}
