//! Small FBX files, written as text and as binary.

use std::fmt::Write as _;

/// Value of a property of an FBX node.
#[derive(Clone)]
pub(crate) enum Value {
    Int(i64),
    Real(f64),
    Text(String),
    /// Name and class of an object.
    Name(String, &'static str),
    Reals(Vec<f64>),
    Ints(Vec<i32>),
    Longs(Vec<i64>),
}

use Value::{Int, Ints, Longs, Name, Real, Reals, Text};

/// Node of an FBX file: name, properties, children.
#[derive(Clone)]
pub(crate) struct Item(&'static str, Vec<Value>, Vec<Item>);

fn leaf(name: &'static str, value: Value) -> Item {
    Item(name, vec![value], Vec::new())
}

/// A row of `Properties70` with numbers.
pub(crate) fn property(name: &str, kind: &str, values: &[f64]) -> Item {
    let words = [name, kind, "", "A"].map(|word| Text(word.into()));
    let values = values.iter().map(|&x| if matches!(kind, "int" | "bool") { Int(x as i64) } else { Real(x) });
    Item("P", words.into_iter().chain(values).collect(), Vec::new())
}

pub(crate) fn object(
    kind: &'static str,
    id: i64,
    name: &str,
    class: &'static str,
    properties: Vec<Item>,
    mut children: Vec<Item>,
) -> Item {
    let prefix =
        if kind == "Deformer" && class != "Skin" && class != "BlendShape" { "SubDeformer" } else { kind };
    children.push(Item("Properties70", Vec::new(), properties));
    Item(kind, vec![Int(id), Name(name.into(), prefix), Text(class.into())], children)
}

/// A connection of an object with another one, or with a property of it.
pub(crate) fn connect(child: i64, parent: i64, property: &str) -> Item {
    let mut values =
        vec![Text(if property.is_empty() { "OO" } else { "OP" }.into()), Int(child), Int(parent)];
    if !property.is_empty() {
        values.push(Text(property.into()));
    }
    Item("C", values, Vec::new())
}

/// A file with centimetres as unit and z up.
pub(crate) fn file(objects: Vec<Item>, connections: Vec<Item>) -> Vec<Item> {
    let axes = [
        ("UpAxis", 2.0),
        ("UpAxisSign", 1.0),
        ("FrontAxis", 1.0),
        ("FrontAxisSign", -1.0),
        ("CoordAxis", 0.0),
        ("CoordAxisSign", 1.0),
    ];
    let mut settings: Vec<Item> = axes.iter().map(|&(name, x)| property(name, "int", &[x])).collect();
    settings.push(property("UnitScaleFactor", "double", &[1.0]));
    vec![
        Item("FBXHeaderExtension", Vec::new(), vec![leaf("FBXVersion", Int(7400))]),
        Item("GlobalSettings", Vec::new(), vec![Item("Properties70", Vec::new(), settings)]),
        Item("Objects", Vec::new(), objects),
        Item("Connections", Vec::new(), connections),
    ]
}

/// Writes the text form.
pub(crate) fn text(items: &[Item]) -> Vec<u8> {
    let mut out = "; FBX 7.4.0 project file\n".to_owned();
    items.iter().for_each(|item| write_text(item, &mut out));
    out.into_bytes()
}

fn write_text(Item(name, values, children): &Item, out: &mut String) {
    fn list<T: std::fmt::Debug>(all: &[T]) -> String {
        let words: Vec<String> = all.iter().map(|x| format!("{x:?}")).collect();
        format!("*{} {{\na: {}\n}}", all.len(), words.join(","))
    }
    let words = values.iter().map(|value| match value {
        Int(x) => x.to_string(),
        Real(x) => format!("{x:?}"),
        Text(text) => format!("\"{text}\""),
        Name(name, class) => format!("\"{class}::{name}\""),
        Reals(all) => list(all),
        Ints(all) => list(all),
        Longs(all) => list(all),
    });
    let words: Vec<String> = words.collect();
    write!(out, "{name}: {}", words.join(", ")).unwrap();
    if !children.is_empty() || values.is_empty() {
        out.push_str(" {\n");
        children.iter().for_each(|child| write_text(child, out));
        out.push('}');
    }
    out.push('\n');
}

/// Writes the binary form, version 7.4.
pub(crate) fn binary(items: &[Item]) -> Vec<u8> {
    let mut out = b"Kaydara FBX Binary  \0\x1a\0".to_vec();
    out.extend(7400_u32.to_le_bytes());
    items.iter().for_each(|item| write_binary(item, &mut out));
    out.extend([0; 13]);
    out
}

fn write_binary(Item(name, values, children): &Item, out: &mut Vec<u8>) {
    fn list<const N: usize>(code: u8, all: impl ExactSizeIterator<Item = [u8; N]>) -> Vec<u8> {
        let sizes = [all.len() as u32, 0, (N * all.len()) as u32].map(u32::to_le_bytes);
        [vec![code], sizes.concat(), all.flatten().collect()].concat()
    }
    fn string(text: &[u8]) -> Vec<u8> {
        [b"S", &(text.len() as u32).to_le_bytes()[..], text].concat()
    }
    let properties: Vec<Vec<u8>> = values
        .iter()
        .map(|value| match value {
            Int(x) => [b"L".to_vec(), x.to_le_bytes().to_vec()].concat(),
            Real(x) => [b"D".to_vec(), x.to_le_bytes().to_vec()].concat(),
            Text(text) => string(text.as_bytes()),
            Name(name, class) => string(format!("{name}\0\x01{class}").as_bytes()),
            Reals(all) => list(b'd', all.iter().map(|x| x.to_le_bytes())),
            Ints(all) => list(b'i', all.iter().map(|x| x.to_le_bytes())),
            Longs(all) => list(b'l', all.iter().map(|x| x.to_le_bytes())),
        })
        .collect();
    let start = out.len();
    let length: usize = properties.iter().map(Vec::len).sum();
    out.extend([0; 4]);
    out.extend([values.len() as u32, length as u32].into_iter().flat_map(u32::to_le_bytes));
    out.push(name.len() as u8);
    out.extend(name.as_bytes());
    out.extend(properties.concat());
    if !children.is_empty() {
        children.iter().for_each(|child| write_binary(child, out));
        out.extend([0; 13]);
    }
    let end = out.len() as u32;
    out[start..start + 4].copy_from_slice(&end.to_le_bytes());
}

/// Size of the box, centimetres.
pub(crate) const BOX: [f64; 3] = [200.0, 100.0, 300.0];

/// The corners of the box, with its lower corner at the origin.
pub(crate) fn corners() -> Vec<[f64; 3]> {
    let bit = |k: usize, axis: usize| if k >> axis & 1 == 1 { BOX[axis] } else { 0.0 };
    (0..8).map(|k| std::array::from_fn(|axis| bit(k, axis))).collect()
}

/// A box of six quadrilaterals, the first three with another material than the rest.
pub(crate) fn geometry(id: i64) -> Item {
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    // The last corner of a polygon is stored as its complement.
    let indices = faces.iter().flat_map(|&[a, b, c, d]| [a, b, c, !d]).collect();
    let layer = |kind: &'static str| {
        let of = vec![leaf("Type", Text(kind.into())), leaf("TypedIndex", Int(0))];
        Item("LayerElement", Vec::new(), of)
    };
    let words = |mapping: &str, reference: &str| {
        vec![
            leaf("MappingInformationType", Text(mapping.into())),
            leaf("ReferenceInformationType", Text(reference.into())),
        ]
    };
    let mut materials = words("ByPolygon", "IndexToDirect");
    materials.push(leaf("Materials", Ints(vec![0, 0, 0, 1, 1, 1])));
    let mut uvs = words("ByPolygonVertex", "IndexToDirect");
    uvs.push(leaf("Name", Text("map".into())));
    uvs.push(leaf("UV", Reals(vec![0.0, 0.0, 1.0, 0.0, 1.0, 0.25, 0.0, 0.25])));
    uvs.push(leaf("UVIndex", Ints([0, 1, 2, 3].repeat(6))));
    let children = vec![
        leaf("Vertices", Reals(corners().concat())),
        leaf("PolygonVertexIndex", Ints(indices)),
        Item("LayerElementMaterial", vec![Int(0)], materials),
        Item("LayerElementUV", vec![Int(0)], uvs),
        Item("Layer", vec![Int(0)], vec![layer("LayerElementMaterial"), layer("LayerElementUV")]),
    ];
    object("Geometry", id, "box", "Mesh", Vec::new(), children)
}

/// A texture whose image is a file.
pub(crate) fn texture(id: i64, name: &str, path: &str, properties: Vec<Item>) -> Item {
    let path = || Text(path.into());
    let files = vec![leaf("FileName", path()), leaf("RelativeFilename", path())];
    object("Texture", id, name, "", properties, files)
}

fn materials() -> Vec<Item> {
    let one = |id, name, color: &[f64]| {
        let properties = vec![property("DiffuseColor", "Color", color)];
        object("Material", id, name, "", properties, vec![leaf("ShadingModel", Text("lambert".into()))])
    };
    let wood = texture(22, "wood", r"C:\work\maps\wood grain.png", Vec::new());
    vec![one(20, "red", &[1.0, 0.0, 0.0]), one(21, "wooden", &[0.5, 0.5, 0.5]), wood]
}

/// A box at a node with a pre-rotation of 90 degrees about z, a translation and a geometric translation.
pub(crate) fn placed() -> Vec<Item> {
    let place = vec![
        property("Lcl Translation", "Lcl Translation", &[10.0, 20.0, 30.0]),
        property("RotationActive", "bool", &[1.0]),
        property("PreRotation", "Vector3D", &[0.0, 0.0, 90.0]),
        property("GeometricTranslation", "Vector3D", &[0.0, 0.0, 5.0]),
    ];
    let mut objects = vec![geometry(1), object("Model", 2, "crate", "Mesh", place, Vec::new())];
    objects.extend(materials());
    let connections = [(2, 0, ""), (1, 2, ""), (20, 2, ""), (21, 2, ""), (22, 21, "DiffuseColor")];
    file(objects, connections.map(|(a, b, p)| connect(a, b, p)).to_vec())
}

/// Time of one second in an FBX file.
const SECOND: i64 = 46_186_158_000;

/// The box with a skin of two joints, a blend shape and a clip of one second. The lower four corners follow "root", the upper four
/// "tip", a child of it at the middle of the box's height. The clip turns "tip" by 90 degrees about x, and moves corner 0
/// by the blend shape.
pub(crate) fn rigged() -> Vec<Item> {
    rigged_with(Vec::new(), Vec::new())
}

/// [`rigged`] with further properties of "root" and "tip".
pub(crate) fn rigged_with(of_root: Vec<Item>, of_tip: Vec<Item>) -> Vec<Item> {
    let middle = BOX[2] / 2.0;
    let limb = |id, name, z: f64, mut properties: Vec<Item>| {
        properties.push(property("Lcl Translation", "Lcl Translation", &[0.0, 0.0, z]));
        object("Model", id, name, "LimbNode", properties, Vec::new())
    };
    let cluster = |id, name, indices: Vec<i32>, z: f64| {
        let moved = |z: f64| {
            let mut matrix = vec![0.0; 16];
            (0..4).for_each(|k| matrix[5 * k] = 1.0);
            matrix[14] = z;
            Reals(matrix)
        };
        let children = vec![
            leaf("Indexes", Ints(indices)),
            leaf("Weights", Reals(vec![1.0; 4])),
            leaf("Transform", moved(-z)),
            leaf("TransformLink", moved(z)),
        ];
        object("Deformer", id, name, "Cluster", Vec::new(), children)
    };
    let shape = vec![
        leaf("Indexes", Ints(vec![0])),
        leaf("Vertices", Reals(vec![-8.0, 0.0, 0.0])),
        leaf("Normals", Reals(vec![0.0; 3])),
    ];
    let channel = vec![leaf("DeformPercent", Real(0.0)), leaf("FullWeights", Reals(vec![100.0]))];
    let curve = |id, last: f64| {
        let children = vec![
            leaf("Default", Real(0.0)),
            leaf("KeyVer", Int(4008)),
            leaf("KeyTime", Longs(vec![0, SECOND])),
            leaf("KeyValueFloat", Reals(vec![0.0, last])),
            // Linear interpolation for both keys.
            leaf("KeyAttrFlags", Ints(vec![4])),
            leaf("KeyAttrDataFloat", Reals(vec![0.0; 4])),
            leaf("KeyAttrRefCount", Ints(vec![2])),
        ];
        object("AnimationCurve", id, "", "", Vec::new(), children)
    };
    let none = Vec::new;
    let ends = vec![Item(
        "P",
        ["LocalStop", "KTime", "Time", ""].map(|w| Text(w.into())).into_iter().chain([Int(SECOND)]).collect(),
        none(),
    )];
    let mut objects = vec![
        geometry(1),
        object("Model", 2, "body", "Mesh", none(), none()),
        limb(3, "root", 0.0, of_root),
        limb(4, "tip", middle, of_tip),
        object("Deformer", 5, "skin", "Skin", none(), none()),
        cluster(6, "lower", vec![0, 1, 2, 3], 0.0),
        cluster(7, "upper", vec![4, 5, 6, 7], middle),
        object("Geometry", 8, "dent", "Shape", none(), shape),
        object("Deformer", 9, "shapes", "BlendShape", none(), none()),
        object("Deformer", 10, "dent", "BlendShapeChannel", none(), channel),
        object("AnimationStack", 11, "bend", "", ends, none()),
        object("AnimationLayer", 12, "layer", "", none(), none()),
        object("AnimationCurveNode", 13, "R", "", vec![property("d|X", "Number", &[0.0])], none()),
        curve(14, 90.0),
        object(
            "AnimationCurveNode",
            15,
            "D",
            "",
            vec![property("d|DeformPercent", "Number", &[0.0])],
            none(),
        ),
        curve(16, 100.0),
    ];
    objects.extend(materials());
    let connections = [
        (2, 0, ""),
        (3, 0, ""),
        (4, 3, ""),
        (1, 2, ""),
        (20, 2, ""),
        (21, 2, ""),
        (22, 21, "DiffuseColor"),
        (5, 1, ""),
        (6, 5, ""),
        (7, 5, ""),
        (3, 6, ""),
        (4, 7, ""),
        (9, 1, ""),
        (10, 9, ""),
        (8, 10, ""),
        (12, 11, ""),
        (13, 12, ""),
        (13, 4, "Lcl Rotation"),
        (14, 13, "d|X"),
        (15, 12, ""),
        (15, 10, "DeformPercent"),
        (16, 15, "d|DeformPercent"),
    ];
    file(objects, connections.map(|(a, b, p)| connect(a, b, p)).to_vec())
}
