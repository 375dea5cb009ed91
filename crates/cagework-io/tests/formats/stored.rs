//! Models passed as arrays of bytes from a web worker to the page.

use cagework_io::{Look, Model, ModelFormat, Store, StoredArrays, UpAxis};
use glam::Vec3;

use crate::common::{PNG, instanced, plate, quantized, rigged, skinned, textured_square};
use crate::compressed;
use crate::glb_export::inline_glb;

const OBJ: &str = "mtllib a.mtl\nmtllib b.mtl\no body\nv 0 0 0 1 0.5 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 1\nvn 0 0 1\ns 1\n\
    usemtl skin\nf 1/1/1 2/2/1 3/1/1\ng arm\nusemtl cloth\nf 1 3 4\n";
const MTL: &str = "newmtl skin\nKd nan 0.5 1\nmap_Kd red dot.png\nnewmtl cloth\nmap_Kd ./red dot.png\n";
const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
    property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\nproperty list uchar int vertex_indices\n\
    end_header\n0 0 0 255 0 0\n1 0 0 0 255 0\n0 1 0 0 0 255\n3 0 1 2\n";

fn read(name: &str, bytes: &[u8]) -> Model {
    let mut resolve = |name: &str| match name {
        "red dot.png" => Some(Ok(PNG.to_vec())),
        "a.mtl" => Some(Ok(MTL.as_bytes().to_vec())),
        _ => None,
    };
    Model::read(name, bytes, &mut resolve).unwrap()
}

fn models() -> Vec<Model> {
    let far = "v 1e6 0 0\nv 1000001 0 0.25\nv 1e6 1 0\nf 1 2 3\n";
    let mut turned = read("turned.obj", far.as_bytes());
    turned.set_up(UpAxis::Z);
    let splat: Vec<u8> = [1.0_f32, 2.0, 3.0, 0.1, 0.1, 0.1].iter().flat_map(|x| x.to_le_bytes()).collect();
    let splat = [splat, vec![255, 128, 0, 200, 255, 128, 128, 128]].concat();
    let files: [(&str, Vec<u8>); 13] = [
        ("textured.glb", textured_square().glb()),
        ("skinned.glb", skinned().glb()),
        ("rigged.glb", rigged().glb()),
        ("instanced.glb", instanced().glb()),
        ("quantized.glb", quantized().glb()),
        ("compressed.glb", compressed::draco(&compressed::draco_stream()).glb()),
        ("inline.glb", inline_glb()),
        ("a.obj", OBJ.into()),
        ("a.ply", PLY.into()),
        ("a.3mf", plate()),
        ("a.splat", splat),
        ("a.spz", include_bytes!("../splats/helix-4.spz").to_vec()),
        ("a.sog", include_bytes!("../splats/helix.sog").to_vec()),
    ];
    files.iter().map(|(name, bytes)| read(name, bytes)).chain([turned]).collect()
}

fn stored<T>(store: impl FnOnce(&mut Store), restore: impl FnOnce(&mut StoredArrays<'_>) -> T) -> (T, usize) {
    let mut all = Store::default();
    store(&mut all);
    let mut arrays = all.into_arrays().into_iter();
    let restored = restore(&mut StoredArrays(&mut || arrays.next()));
    (restored, arrays.len())
}

fn without_contents(mut look: Look) -> Look {
    look.images.iter_mut().for_each(|image| image.bytes.clear());
    look
}

/// A restored model has the same properties and writes the same files as the model that was stored.
#[test]
fn restored_models_write_the_same_files() {
    for model in models() {
        let name = &model.name;
        let (restored, left) = stored(|to| model.clone().store(to), |from| Model::restore(from).unwrap());
        assert_eq!(left, 0, "{name}");
        let facts = |m: &Model| {
            (m.name.clone(), m.notices.clone(), m.counts, m.up(), m.origin(), m.bytes(), m.format())
        };
        assert_eq!(facts(&restored), facts(&model));
        assert_eq!(
            (&restored.positions, &restored.triangles),
            (&model.positions, &model.triangles),
            "{name}"
        );
        assert_eq!(restored.splats(), model.splats(), "{name}");
        let moved: Vec<Vec3> = model.positions.iter().map(|p| *p + Vec3::new(0.5 * p.y, 0.25, 0.0)).collect();
        for positions in [&model.positions, &moved] {
            for format in [model.format(), ModelFormat::Gltf, ModelFormat::Obj] {
                let (now, before) = (restored.write(format, positions), model.write(format, positions));
                assert_eq!(now, before, "{name} as {format:?}");
            }
        }
        assert_eq!(restored.clips().len(), model.clips().len());
        // Compare as text, because NaN does not equal itself.
        let look = without_contents(model.look());
        let (again, left) = stored(|to| look.clone().store(to), |from| Look::restore(from).unwrap());
        assert_eq!((format!("{again:?}"), left), (format!("{look:?}"), 0), "{name}");
        assert_eq!(format!("{:?}", restored.look()), format!("{:?}", model.look()), "{name}");
    }
}

#[test]
fn missing_and_damaged_arrays_are_errors() {
    for model in models() {
        let mut store = Store::default();
        model.clone().store(&mut store);
        let arrays = store.into_arrays();
        for n in 0..arrays.len() {
            let mut first = arrays[..n].iter().cloned();
            assert!(Model::restore(&mut StoredArrays(&mut || first.next())).is_err(), "{} {n}", model.name);
        }
        let mut other = std::iter::repeat(b"[1]".to_vec());
        assert!(Model::restore(&mut StoredArrays(&mut || other.next())).is_err());
    }
}
