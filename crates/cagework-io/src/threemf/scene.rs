//! Instances of objects, as placed by the build.

use std::collections::HashMap;

use glam::DAffine3;

use super::package::{Package, fault};
use super::part::{MAX_OBJECTS, ModelPart, Object, PartCounts, Placement};
use crate::archive::part_name;
use crate::gltf::{MAX_ELEMENTS, MAX_TRIANGLES};
use crate::order::{Order, Permit, Price};
use crate::polygons::{Polygons, PolygonsError};
use crate::shown::shown;

/// Limit on the nesting of components.
const MAX_DEPTH: u32 = 64;

/// Limit on the bytes of the names of all instances: 256 each for the largest number of instances. Groups of faces copy
/// the name of their instance, and commands list them.
const MAX_NAME_BYTES: u64 = 256 * MAX_OBJECTS;

/// Memory of an instance and of its group of faces, bytes, without the group's copy of the name.
const INSTANCE_BYTES: u64 = 300;

/// Index of a part, and of an object in it.
pub(super) type Key = (usize, usize);

/// All model parts, and the instances of their objects.
pub(super) struct Scene {
    /// Name and content of each part; the first one has the build.
    pub(super) parts: Vec<(String, ModelPart)>,
    /// Index of each part by [`part_name`].
    part_of: HashMap<Vec<u8>, usize>,
    /// Instances in the order of the components and items in the file, with children before the object's own triangles.
    pub(super) instances: Vec<Instance>,
    pub(super) n_vertices: usize,
    pub(super) notices: Vec<String>,
    /// Memory of the archive and of its texts, bytes.
    pub(super) bytes: u64,
}

/// A placement of an object that has vertices.
pub(super) struct Instance {
    pub(super) object: Key,
    /// The object itself or the nearest object that contains it, whichever has a name.
    named: Option<Key>,
    /// Transform from the object's space to the space of the build.
    pub(super) transform: DAffine3,
    pub(super) first_vertex: u32,
}

/// Counts of an object together with the objects that it contains.
#[derive(Clone, Copy, Default)]
struct Totals {
    vertices: u64,
    triangles: u64,
    instances: u64,
    /// Bytes of the names of the instances, and number of instances that take the name of an object that contains
    /// them.
    names: u64,
    unnamed: u64,
    depth: u32,
}

impl Order for Totals {
    fn price(&self) -> Price {
        let counts = vec![
            ("objects", self.instances, MAX_OBJECTS),
            ("vertices", self.vertices, MAX_ELEMENTS),
            ("triangles", self.triangles, MAX_TRIANGLES),
            ("characters in the names of its objects", self.names, MAX_NAME_BYTES),
        ];
        let of_instances = INSTANCE_BYTES.saturating_mul(self.instances).saturating_add(self.names);
        let of_mesh = Polygons::bytes_of(self.vertices, self.triangles.saturating_mul(3));
        Price { counts, bytes: of_instances.saturating_add(of_mesh), ..Price::default() }
    }
}

impl Totals {
    fn add(&mut self, other: Self) {
        self.vertices = self.vertices.saturating_add(other.vertices);
        self.triangles = self.triangles.saturating_add(other.triangles);
        self.instances = self.instances.saturating_add(other.instances);
        self.names = self.names.saturating_add(other.names);
        self.unnamed = self.unnamed.saturating_add(other.unnamed);
        self.depth = self.depth.max(other.depth);
    }
}

/// State of measuring an object.
#[derive(Clone, Copy)]
enum Measurement {
    New,
    /// A component of the object is being measured. Reaching the object again means that it contains itself.
    Open,
    Done(Totals),
}

impl Scene {
    /// Reads all parts that the build needs, prices the instances, and creates them.
    pub(super) fn read(bytes: &[u8], memory_limit: u64) -> Result<Self, PolygonsError> {
        let mut package = Package::open(bytes, memory_limit)?;
        let first = package.first_part()?;
        let mut scene = Self {
            parts: Vec::new(),
            part_of: HashMap::new(),
            instances: Vec::new(),
            n_vertices: 0,
            notices: Vec::new(),
            bytes: 0,
        };
        let mut counts = PartCounts::default();
        scene.load(&mut package, &first, &mut counts)?;
        let mut next = 0;
        while next < scene.parts.len() {
            let part = &scene.parts[next].1;
            let components = part.objects.iter().flat_map(|object| &object.components);
            let mut paths: Vec<String> =
                components.chain(&part.items).filter_map(|place| place.path.clone()).collect();
            paths.sort_unstable();
            paths.dedup();
            for path in paths {
                if scene.part(&path).is_none() {
                    scene.load(&mut package, &path, &mut counts)?;
                }
            }
            next += 1;
        }
        scene.bytes = package.budget.held();
        let permit = package.budget.permit(scene.totals()?)?;
        scene.place(&permit)?;
        Ok(scene)
    }

    fn load(
        &mut self,
        package: &mut Package<'_>,
        name: &str,
        counts: &mut PartCounts,
    ) -> Result<(), PolygonsError> {
        let index = package.archive.index(name).ok_or_else(|| fault(name, "is missing"))?;
        let part = ModelPart::read(name, &package.text(name, index)?, counts)?;
        if let Some((root, first)) = self.parts.first()
            && first.unit != part.unit
        {
            let [unit, of_first, root] = [&part.unit, &first.unit, root].map(|text| shown(text));
            let problem = format!("has the unit {unit}, but '{root}' has {of_first}: use one unit");
            return Err(fault(name, &problem));
        }
        self.part_of.insert(part_name(name.as_bytes()), self.parts.len());
        self.parts.push((name.to_owned(), part));
        Ok(())
    }

    fn part(&self, path: &str) -> Option<usize> {
        self.part_of.get(&part_name(path.as_bytes())).copied()
    }

    pub(super) fn object(&self, key: Key) -> &Object {
        &self.parts[key.0].1.objects[key.1]
    }

    /// Finds the object that a component or an item of part `part` shows.
    pub(super) fn target(&self, part: usize, place: &Placement) -> Result<Key, PolygonsError> {
        let of = place.path.as_ref().map_or(Some(part), |path| self.part(path)).unwrap_or(part);
        let index = self.parts[of].1.index_of.get(&place.object);
        let problem = || format!(": it shows object {}, which does not exist", place.object);
        index.map(|&index| (of, index)).ok_or_else(|| fault(&self.parts[part].0, &problem()))
    }

    /// The name of an instance; empty if neither the object nor any that contains it has one.
    pub(super) fn name(&self, instance: &Instance) -> &str {
        instance.named.map_or("", |key| &self.object(key).name)
    }

    /// Counts what the build shows.
    fn totals(&self) -> Result<Totals, PolygonsError> {
        let new = |(_, part): &(String, ModelPart)| vec![Measurement::New; part.objects.len()];
        let mut states: Vec<Vec<Measurement>> = self.parts.iter().map(new).collect();
        let mut all = Totals::default();
        for item in &self.parts[0].1.items {
            all.add(self.measure(self.target(0, item)?, 0, &mut states)?);
        }
        Ok(all)
    }

    /// Creates the instances in order.
    fn place(&mut self, all: &Permit<Totals>) -> Result<(), PolygonsError> {
        if all.triangles == 0 && self.parts[0].1.items.is_empty() {
            return Err(PolygonsError::NoItems);
        }
        self.n_vertices = all.vertices as usize;
        let mut instances = Vec::with_capacity(all.instances as usize);
        let mut n = 0;
        for item in &self.parts[0].1.items {
            self.add_instances(self.target(0, item)?, item.transform, None, &mut n, &mut instances)?;
        }
        self.instances = instances;
        for (_, part) in &self.parts {
            let notices = part.unseen.iter().map(|what| format!("{what} are kept, but not shown"));
            let new: Vec<String> = notices.filter(|notice| !self.notices.contains(notice)).collect();
            self.notices.extend(new);
        }
        let unit = &self.parts[0].1.unit;
        if unit != "millimeter" {
            let unit = shown(unit);
            self.notices.push(format!("its unit is the {unit}: coordinates are not converted"));
        }
        Ok(())
    }

    /// Counts the instances, vertices and triangles of an object and its components, and the depth of their nesting.
    fn measure(
        &self,
        key: Key,
        depth: u32,
        states: &mut [Vec<Measurement>],
    ) -> Result<Totals, PolygonsError> {
        let object = self.object(key);
        let nested = || {
            let problem = format!(
                ": components of object {} contain it, or are nested more than {MAX_DEPTH} deep",
                object.id
            );
            fault(&self.parts[key.0].0, &problem)
        };
        match states[key.0][key.1] {
            Measurement::Done(size) if depth + size.depth <= MAX_DEPTH => return Ok(size),
            Measurement::New if depth < MAX_DEPTH => states[key.0][key.1] = Measurement::Open,
            _ => return Err(nested()),
        }
        let mut size = Totals {
            vertices: object.vertices.len() as u64,
            triangles: object.triangles.len() as u64,
            instances: 1,
            names: 0,
            unnamed: 1,
            depth: 0,
        };
        for component in &object.components {
            size.add(self.measure(self.target(key.0, component)?, depth + 1, states)?);
        }
        if !object.name.is_empty() {
            let inherited = std::mem::take(&mut size.unnamed).saturating_mul(object.name.len() as u64);
            size.names = size.names.saturating_add(inherited);
        }
        size.depth += 1;
        states[key.0][key.1] = Measurement::Done(size);
        Ok(size)
    }

    fn add_instances(
        &self,
        key: Key,
        transform: DAffine3,
        named: Option<Key>,
        n: &mut u32,
        to: &mut Vec<Instance>,
    ) -> Result<(), PolygonsError> {
        let object = self.object(key);
        let named = if object.name.is_empty() { named } else { Some(key) };
        for component in &object.components {
            let target = self.target(key.0, component)?;
            self.add_instances(target, transform * component.transform, named, n, to)?;
        }
        if !object.vertices.is_empty() {
            to.push(Instance { object: key, named, transform, first_vertex: *n });
            *n += object.vertices.len() as u32;
        }
        Ok(())
    }
}
