//! NPZ reader and writer.

use std::io::{Cursor, Read as _, Write as _};

use cagework_core::deform::OutsideVertex;
use cagework_core::field::{Field, Lattice};
use cagework_core::{Bounds, Cage, Frames, Weights, subdivided_box};
use cagework_io::{
    FbxDisplacements, SavedWeights, UpAxis, read_weights_npz, write_displacements_npz, write_field_npz,
    write_weights_npz, write_zip,
};
use glam::{DVec3, UVec3, Vec3};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

/// Memory limit of the reader in these tests, bytes.
const LIMIT: u64 = 1 << 20;

/// Three rows, the second of them empty, and the last outside the cage. The columns are five controls, then the offsets
/// of [`Frames`]: three columns that do not rotate, three of the whole cage, and six of bone ends.
fn sample() -> (Weights, Frames, Vec<OutsideVertex>) {
    let indices = vec![0, 6, 1, 2, 3, 16];
    let weights =
        Weights::new(17, vec![0, 2, 2, 6], indices, vec![0.25, 0.75, 0.5, 0.375, 0.125, 0.5]).unwrap();
    let plain = vec![[0.5, -1.0, 2.0, 0.25]; 2];
    let frames = Frames { whole: vec![[0.5, 0.25, -2.0]], joints: vec![1, 0], bones: vec![[0, 1]], plain };
    (weights, frames, vec![OutsideVertex { vertex: 2, distance: 0.5, share: 0.25 }])
}

fn saved((weights, frames, outside): (Weights, Frames, Vec<OutsideVertex>)) -> SavedWeights {
    SavedWeights { weights, frames, outside, extra_points: vec![], inner_controls: vec![] }
}

#[test]
fn an_archive_holds_files_with_distinct_names() {
    let files = [("a.glb".to_owned(), vec![1, 2, 3]), ("é b.obj".to_owned(), Vec::new())];
    let mut archive = ZipArchive::new(Cursor::new(write_zip(&files).unwrap())).unwrap();
    for (name, bytes) in &files {
        let mut found = Vec::new();
        archive.by_name(name).unwrap().read_to_end(&mut found).unwrap();
        assert_eq!(&found, bytes);
    }
    assert_eq!(write_zip(&[files[0].clone(), files[0].clone()]), None);
}

#[test]
fn points_of_a_rig_are_the_last_rows() {
    let (weights, frames, outside) = sample();
    let points = [Vec3::X, Vec3::new(0.5, -2.0, 8.0)];
    let read =
        read_weights_npz(&write_weights_npz(&weights, &frames, &outside, &points, &points), LIMIT).unwrap();
    assert_eq!((read.n_vertices(), read.extra_points.as_slice()), (1, points.as_slice()));
    let of_vertices = read.of_vertices();
    assert_eq!(of_vertices.weights, weights.with_rows(&[0]));
    assert!(of_vertices.outside.is_empty() && of_vertices.extra_points.is_empty());
    let too_many = [Vec3::X; 4];
    let message = read_weights_npz(&write_weights_npz(&weights, &frames, &[], &too_many, &[]), LIMIT)
        .unwrap_err()
        .to_string();
    assert_eq!(message, "array 'extra_points': has 4 points, but the matrix has 3 rows");
}

#[test]
fn displacements_have_three_arrays_per_mesh_and_names_in_unicode() {
    let mesh = |node: &str, n: usize| FbxDisplacements {
        node: node.into(),
        mesh: "box".into(),
        indices: vec![7; n],
        positions: vec![[1.0, 2.0, 3.0]; n],
        displacements: vec![vec![[0.0; 3]; n], vec![[0.0, 0.0, 0.5]; n]],
    };
    let bytes = write_displacements_npz(&["a".into(), "b".into()], &[mesh("é", 2), mesh("leg", 1)]);
    let mut zip = ZipArchive::new(Cursor::new(bytes)).unwrap();
    let mut array = |name: &str, kind: &str| {
        let mut bytes = Vec::new();
        zip.by_name(name).unwrap().read_to_end(&mut bytes).unwrap();
        let (header, data) = bytes.split_at(128);
        let header = std::str::from_utf8(&header[10..]).unwrap();
        assert!(header.contains(kind), "{name}: {header}");
        data.to_vec()
    };
    let names: Vec<u8> = "é\0\0leg".chars().flat_map(|c| u32::from(c).to_le_bytes()).collect();
    assert_eq!(array("nodes.npy", "'<U3', 'fortran_order': False, 'shape': (2,)"), names);
    assert_eq!(array("poses.npy", "(2,)").len(), 8);
    assert_eq!(
        array("indices_0.npy", "'<i4', 'fortran_order': False, 'shape': (2,)"),
        [7, 0, 0, 0, 7, 0, 0, 0]
    );
    assert_eq!(array("positions_1.npy", "(1, 3)"), [1.0, 2.0, 3.0_f32].map(f32::to_le_bytes).concat());
    let last = [[0.0; 3], [0.0, 0.0, 0.5_f32]]
        .as_flattened()
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect::<Vec<_>>();
    assert_eq!(array("displacements_1.npy", "(2, 1, 3)"), last);
}

/// Arrays of a field whose displacements are `u = (0.1 y, 0.2 z, 0.3 x)`, in the axes of files with this up axis.
struct WrittenField {
    lattice: Lattice,
    dims: [usize; 3],
    origin: DVec3,
    u: Vec<f32>,
    gradients: Vec<f32>,
}

impl WrittenField {
    fn new(up: UpAxis) -> Self {
        let bounds = Bounds { min: Vec3::ZERO, max: Vec3::new(1.0, 4.0, 8.0) };
        let cage = Cage::new(&subdivided_box(bounds, 0.0, [1; 3])).unwrap();
        let lattice = Lattice::new(&cage, 32);
        let [nx, ny, nz] = lattice.dims.to_array();
        assert!(nx < ny && ny < nz);
        let mut values = Vec::new();
        for z in 0..nz {
            for y in 0..ny {
                let place = |x| lattice.origin + lattice.cell * UVec3::new(x, y, z).as_vec3();
                values.extend((0..nx).map(|x| displacement(place(x)).extend(1.0)));
            }
        }
        let bytes = write_field_npz(&Field::of_values(lattice.clone(), values), FAR, up);
        let dims = match up {
            UpAxis::Z => [nx, nz, ny],
            UpAxis::Y | UpAxis::YDown => [nx, ny, nz],
        };
        let array = |name: &str, shape: &str| {
            let mut zip = ZipArchive::new(Cursor::new(bytes.as_slice())).unwrap();
            let mut bytes = Vec::new();
            zip.by_name(name).unwrap().read_to_end(&mut bytes).unwrap();
            let (header, data) = bytes.split_at(128);
            assert!(std::str::from_utf8(&header[10..]).unwrap().contains(shape), "{name}");
            data.to_vec()
        };
        let floats = |data: Vec<u8>| data.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
        let shape = format!("({}, {}, {}", dims[0], dims[1], dims[2]);
        assert!(array("bound.npy", &format!("{shape})")).iter().all(|&b| b == 1));
        let origin: Vec<f64> =
            array("origin.npy", "(3,)").as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
        Self {
            lattice,
            dims: dims.map(|n| n as usize),
            origin: DVec3::from_slice(&origin),
            u: floats(array("u.npy", &format!("{shape}, 3)"))),
            gradients: floats(array("F.npy", &format!("{shape}, 3, 3)"))),
        }
    }
}

/// Origin that is given to the writer, in the axes of the files.
const FAR: DVec3 = DVec3::new(100.0, -200.0, 300.0);

/// Displacement at a point, with y up.
fn displacement(p: Vec3) -> Vec3 {
    Vec3::new(0.1 * p.y, 0.2 * p.z, 0.3 * p.x)
}

#[test]
fn field_is_written_with_z_as_the_fastest_axis() {
    let WrittenField { lattice, dims: [_, ny, nz], origin, u, gradients } = WrittenField::new(UpAxis::Y);
    let (x, y, z) = (1, 2, 3);
    let node = z + nz * (y + ny * x);
    let at = lattice.origin + lattice.cell * Vec3::new(1.0, 2.0, 3.0);
    assert_eq!(u[3 * node..3 * node + 3], displacement(at).to_array());
    // F[i][j] is the change of component i along axis j.
    let expected = [1.0, 0.1, 0.0, 0.0, 1.0, 0.2, 0.3, 0.0, 1.0];
    let close =
        gradients[9 * node..][..9].iter().zip(expected).all(|(a, b): (&f32, f32)| (a - b).abs() < 1e-5);
    assert!(close, "{:?}", &gradients[9 * node..][..9]);
    assert_eq!(origin, FAR + lattice.origin.as_dvec3());
}

/// Tolerance for numbers of at most 10 that were computed in `f32`, object units.
const FIELD_TOLERANCE: f64 = 1e-5;

/// A file with z up has the point (x, -z, y) where the field has (x, y, z), and one with y down has (x, -y, -z). So the
/// displacement (0.1 y, 0.2 z, 0.3 x) at a point (a, b, c) of the file is (0.1 c, -0.3 a, -0.2 b) with z up, and
/// (-0.1 b, 0.2 c, -0.3 a) with y down. Rows of F are the derivatives of these plus the identity.
#[test]
fn fields_are_written_in_the_axes_of_the_files() {
    type OfPoint = fn(DVec3) -> DVec3;
    let with_z: OfPoint = |p| DVec3::new(0.1 * p.z, -0.3 * p.x, -0.2 * p.y);
    let with_y_down: OfPoint = |p| DVec3::new(-0.1 * p.y, 0.2 * p.z, -0.3 * p.x);
    for (up, of_point, expected) in [
        (UpAxis::Z, with_z, [1.0, 0.0, 0.1, -0.3, 1.0, 0.0, 0.0, -0.2, 1.0]),
        (UpAxis::YDown, with_y_down, [1.0, -0.1, 0.0, 0.0, 1.0, 0.2, -0.3, 0.0, 1.0]),
    ] {
        let WrittenField { lattice, dims: [nx, ny, nz], origin, u, gradients } = WrittenField::new(up);
        let nodes = (0..nx).flat_map(|x| (0..ny).flat_map(move |y| (0..nz).map(move |z| [x, y, z])));
        for (node, steps) in nodes.enumerate() {
            let at = origin - FAR + f64::from(lattice.cell) * DVec3::from(steps.map(|n| n as f64));
            let u = DVec3::new(u[3 * node].into(), u[3 * node + 1].into(), u[3 * node + 2].into());
            assert!(u.distance(of_point(at)) < FIELD_TOLERANCE, "{up:?} at {at}: {u}");
            let rows = &gradients[9 * node..][..9];
            let close = rows.iter().zip(expected).all(|(&a, b)| (f64::from(a) - b).abs() < FIELD_TOLERANCE);
            assert!(close, "{up:?} at {at}: {rows:?}");
        }
    }
}

/// The file of [`sample`], deflated as by SciPy, with `change` applied to each array. Arrays for which `change` returns
/// `None` are omitted.
fn rewritten(change: impl Fn(&str, Vec<u8>) -> Option<Vec<u8>>) -> Vec<u8> {
    let (weights, frames, outside) = sample();
    let bytes = write_weights_npz(&weights, &frames, &outside, &[], &[]);
    let mut from = ZipArchive::new(Cursor::new(bytes.as_slice())).unwrap();
    let mut to = ZipWriter::new(Cursor::new(Vec::new()));
    for i in 0..from.len() {
        let mut entry = from.by_index(i).unwrap();
        let (name, mut data) = (entry.name().unwrap().into_owned(), Vec::new());
        entry.read_to_end(&mut data).unwrap();
        if let Some(data) = change(&name, data) {
            to.start_file(name, SimpleFileOptions::default().compression_method(CompressionMethod::Deflated))
                .unwrap();
            to.write_all(&data).unwrap();
        }
    }
    to.finish().unwrap().into_inner()
}

#[test]
fn weights_round_trip_and_bytes_are_reproducible() {
    let (weights, frames, outside) = sample();
    let bytes = write_weights_npz(&weights, &frames, &outside, &[], &[]);
    assert_eq!(bytes, write_weights_npz(&weights, &frames, &outside, &[], &[]));
    assert_eq!(read_weights_npz(&bytes, LIMIT).unwrap(), saved((weights.clone(), frames, outside)));
    let (plain, none) = (weights.columns(0..5), Frames::default());
    let bytes = write_weights_npz(&plain, &none, &[], &[], &[]);
    assert_eq!(read_weights_npz(&bytes, LIMIT).unwrap(), saved((plain, none, vec![])));
}

#[test]
fn headers_equal_those_of_numpy() {
    let (weights, frames, _) = sample();
    let bytes = write_weights_npz(&weights, &frames, &[], &[], &[]);
    let mut zip = ZipArchive::new(Cursor::new(bytes.as_slice())).unwrap();
    let mut data = Vec::new();
    zip.by_name("indptr.npy").unwrap().read_to_end(&mut data).unwrap();
    // Format of numpy.lib.format, version 1.0: magic, version, length of the dict, and the dict, padded with spaces and
    // a final newline so that the size of the header is a multiple of 64.
    let header = b"{'descr': '<i4', 'fortran_order': False, 'shape': (4,), }";
    assert_eq!(&data[..8], b"\x93NUMPY\x01\0");
    assert_eq!(u16::from_le_bytes([data[8], data[9]]), 118);
    assert_eq!(&data[10..10 + header.len()], header);
    assert_eq!((data[127], data.len()), (b'\n', 128 + 4 * 4));
}

#[test]
fn deflated_files_with_wide_numbers_are_read() {
    let wide = rewritten(|name, data| {
        let word = |b: &[u8]| <[u8; 4]>::try_from(b).unwrap();
        let wide_int = |b: &[u8]| i64::from(i32::from_le_bytes(word(b))).to_le_bytes();
        let wide_float = |b: &[u8]| f64::from(f32::from_le_bytes(word(b))).to_le_bytes();
        let chunks = data[128..].chunks(4);
        let (from, body): (_, Vec<u8>) = match name {
            "indptr.npy" | "indices.npy" => (b"<i4", chunks.flat_map(wide_int).collect()),
            "data.npy" => (b"<f4", chunks.flat_map(wide_float).collect()),
            _ => return Some(data),
        };
        let mut out = data[..128].to_vec();
        let place = out.windows(3).position(|w| w == from).unwrap();
        out[place + 2] = b'8';
        out.extend(body);
        Some(out)
    });
    assert_eq!(read_weights_npz(&wide, LIMIT).unwrap(), saved(sample()));
}

/// `numpy.savez(format="csr")` writes the name as `<U3`: three characters of 4 bytes, as numpy.lib.format documents.
#[test]
fn the_name_of_the_layout_may_be_unicode() {
    let written = |name: &'static str, dtype: &'static str| {
        rewritten(move |n, d| {
            let header = String::from_utf8_lossy(&d[10..128.min(d.len())]).replace("|S3", dtype);
            let name: Vec<u8> = name.chars().flat_map(|c| u32::from(c).to_le_bytes()).collect();
            Some(if n == "format.npy" { [&d[..10], header.as_bytes(), &name].concat() } else { d })
        })
    };
    assert_eq!(read_weights_npz(&written("csr", "<U3"), LIMIT).unwrap(), saved(sample()));
    assert_eq!(read_weights_npz(&written("csr\0", "<U4"), LIMIT).unwrap(), saved(sample()));
    let message = |bytes: &[u8]| read_weights_npz(bytes, LIMIT).unwrap_err().to_string();
    assert!(message(&written("csc", "<U3")).contains("is 'csc', but only csr is read"));
    assert!(message(&written("cs", "<f8")).contains("has type <f8; it must be a string"));
}

#[test]
fn errors_name_the_array_at_fault() {
    let message = |bytes: &[u8]| read_weights_npz(bytes, LIMIT).unwrap_err().to_string();
    assert!(message(b"no zip").contains("not an .npz"));
    for name in ["format", "shape", "indptr", "indices", "data"] {
        let file = format!("{name}.npy");
        let without = rewritten(|n, d| (n != file).then_some(d));
        assert!(message(&without).contains(&format!("'{name}' is missing")));
        let garbage =
            rewritten(|n, d| Some(if n == file { b"\x93NUMPY\x01\0\xff\xff{".to_vec() } else { d }));
        assert!(message(&garbage).contains(name));
    }
    let csc = rewritten(|n, d| Some(if n == "format.npy" { [&d[..128], b"csc"].concat() } else { d }));
    assert!(message(&csc).contains("tocsr"));
    let cut = rewritten(|n, d| Some(if n == "data.npy" { d[..d.len() - 2].to_vec() } else { d }));
    assert!(message(&cut).contains("14 bytes"));
    let high = rewritten(|n, d| {
        Some(if n == "indices.npy" { [&d[..d.len() - 4], &9_i32.to_le_bytes()].concat() } else { d })
    });
    assert!(message(&high).contains("column 9"));
    let negative = rewritten(|n, d| {
        Some(if n == "indices.npy" { [&d[..d.len() - 4], &(-1_i32).to_le_bytes()].concat() } else { d })
    });
    assert!(message(&negative).contains("negative"));
    // Columns 1, 2, 3 of the last row become 1, 2, 1, which is not ascending.
    let twice = rewritten(|n, d| {
        Some(if n == "indices.npy" { [&d[..d.len() - 4], &1_i32.to_le_bytes()].concat() } else { d })
    });
    assert!(message(&twice).contains("row 2 names column 1 twice"));
}

#[test]
fn shapes_that_do_not_match_the_data_are_rejected() {
    for (name, from, to) in [
        ("indices.npy", "(4,), }", "(6,), }"),
        ("data.npy", "(4,), }", "(3,), }"),
        ("data.npy", "(4,), }", "(4, 1)}"),
        ("indptr.npy", "(4,), }", "(2, 2)}"),
        ("shape.npy", "(2,), }", "(), }  "),
        ("frame_bones.npy", "(1, 2), }", "(2, 1), }"),
        ("frame_plain.npy", "(2, 4), }", "(8,), }  "),
        // The product of the lengths overflows 64 bits and becomes 4.
        ("indptr.npy", "(4,), }                               ", "(4611686018427387905, 4), }           "),
    ] {
        let wrong = rewritten(|n, d| {
            if n != name {
                return Some(d);
            }
            let place = d.windows(from.len()).position(|w| w == from.as_bytes()).unwrap();
            Some([&d[..place], to.as_bytes(), &d[place + from.len()..]].concat())
        });
        let message = read_weights_npz(&wrong, LIMIT).unwrap_err().to_string();
        assert!(message.contains(&name.replace(".npy", "")) && message.contains("shape"), "{to}: {message}");
    }
}

/// A small deflated file can unpack to gigabytes.
#[test]
fn entries_are_unpacked_up_to_the_size_of_their_shapes() {
    let endless = rewritten(|n, d| Some(if n == "format.npy" { [d, vec![0; 9 << 20]].concat() } else { d }));
    let message = read_weights_npz(&endless, LIMIT).unwrap_err().to_string();
    assert!(message.contains("'format': is longer than the 3 bytes"), "{message}");
    // An array of 40 MB with a matching shape exceeds the memory limit.
    let honest = rewritten(|n, d| {
        let header =
            String::from_utf8_lossy(&d[10..128.min(d.len())]).replace("(4,), }       ", "(10000000,), }");
        let header = [&d[..10], header.as_bytes()].concat();
        Some(if n == "indptr.npy" { [header, vec![0; 40_000_000]].concat() } else { d })
    });
    let message = read_weights_npz(&honest, LIMIT).unwrap_err().to_string();
    assert!(message.contains("needs about 77 MiB of memory, more than the limit of 1 MiB"), "{message}");
    // The limit of a small file does not depend on the memory limit.
    let long = rewritten(|n, d| {
        let place = d.windows(19).position(|w| w == b"(4,), }            ").filter(|_| n == "data.npy");
        Some(match place {
            Some(place) => [&d[..place], b"(40000000,), }     ", &d[place + 19..]].concat(),
            None => d,
        })
    });
    let message = read_weights_npz(&long, u64::MAX).unwrap_err().to_string();
    assert!(
        message.contains("'data': its ") && message.contains("limit of 64 MiB or 100 times"),
        "{message}"
    );
}
