//! The models in one cage, as one mesh: vertices and triangles of the first, then those of the next.
//!
//! Models have numbers that stay, whatever else comes and goes: one that was taken out is kept, so that undo brings it back. Points
//! of the surface are told by triangles that are counted on through all of them, those taken out too.

use std::ops::Range;
use std::sync::Arc;

use cagework_gpu::render::DrawModel;
use cagework_io::{Model, UpAxis};
use cagework_pose::Parts;
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use crate::error::{Answer, ErrorName, Fault};

/// Most that a project may count a model's first triangle as: models that come after it have room to be counted on.
const MAX_FIRST: u32 = u32::MAX / 2;
/// The name that stands for all of a model.
const WHOLE: &str = "all";

/// What of a model is shown, and what the cage does not bend.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct PartOptions {
    pub(crate) shown: bool,
    /// Names of what keeps its shape; "all" for the whole model.
    pub(crate) rigid: Vec<String>,
    /// Names of what stays as it is; "all" for the whole model.
    pub(crate) stays: Vec<String>,
}

impl Default for PartOptions {
    fn default() -> Self {
        Self { shown: true, rigid: Vec::new(), stays: Vec::new() }
    }
}

/// What a project says of one of its models besides its file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct MemberSettings {
    /// What its first triangle is counted as.
    first_triangle: u32,
    options: PartOptions,
    /// How much of each vertex is painted to stay, 0 to 255, and of how many vertices in turn; empty for nothing.
    painted: Vec<(u8, u32)>,
}

/// One of the models.
#[derive(Clone)]
pub(crate) struct Member {
    pub(crate) id: u32,
    pub(crate) model: Arc<Model>,
    pub(crate) options: PartOptions,
    /// How much of each vertex is painted to stay, 0 to 255; empty for nothing.
    pub(crate) painted: Vec<u8>,
    draw: Arc<DrawModel>,
    is_binned: bool,
    first_triangle: u32,
    /// In the mesh of all; of nothing while it is binned.
    pub(crate) vertices: Range<usize>,
    pub(crate) triangles: Range<usize>,
}

/// The models in one cage. A clone shares their files.
#[derive(Clone, Default)]
pub(crate) struct Models {
    all: Vec<Member>,
    /// Vertices of all that are in the cage, at rest. `[n_vertices]`
    pub(crate) positions: Vec<Vec3>,
    /// `[n_triangles]`
    pub(crate) triangles: Vec<[u32; 3]>,
}

impl Models {
    /// A model in a cage of its own. `settings`: a project's.
    pub(crate) fn one(model: Model, draw: DrawModel, settings: Option<MemberSettings>) -> Self {
        let mut models = Self::default();
        models.add([(model, draw, settings)]);
        models
    }

    /// Puts others into the cage, each with what a project says of it.
    pub(crate) fn add(
        &mut self,
        others: impl IntoIterator<Item = (Model, DrawModel, Option<MemberSettings>)>,
    ) {
        for (model, draw, settings) in others {
            self.push(model, draw, settings);
        }
        self.join();
    }

    fn push(&mut self, model: Model, draw: DrawModel, settings: Option<MemberSettings>) {
        // They ascend.
        let next = self.all.last().map_or(0, |m| m.first_triangle + m.model.triangles.len() as u32);
        let mut member = Member {
            id: self.all.len() as u32,
            options: PartOptions::default(),
            painted: Vec::new(),
            draw: Arc::new(draw),
            is_binned: false,
            // Never below what is there: points of the surface mean one triangle.
            first_triangle: settings.as_ref().map_or(0, |s| s.first_triangle).min(MAX_FIRST).max(next),
            vertices: 0..0,
            triangles: 0..0,
            model: Arc::new(model),
        };
        if let Some(MemberSettings { options, painted, .. }) = settings {
            let kept = |names: &[String]| names.iter().filter(|name| member.selects(name)).cloned().collect();
            member.options = PartOptions {
                shown: options.shown,
                rigid: kept(&options.rigid),
                stays: kept(&options.stays),
            };
            let n: u64 = painted.iter().map(|&(_, n)| u64::from(n)).sum();
            if n == member.model.positions.len() as u64 {
                member.painted =
                    painted.iter().flat_map(|&(amount, n)| std::iter::repeat_n(amount, n as usize)).collect();
            }
        }
        self.all.push(member);
    }

    /// Takes some out, or brings them back.
    ///
    /// # Errors
    /// When there is no such model, or none would be left; nothing changes then.
    pub(crate) fn bin(&mut self, ids: &[u32], is_binned: bool) -> Answer<()> {
        if ids.iter().any(|&id| id as usize >= self.all.len()) {
            return Err(no_model());
        }
        let before: Vec<bool> = self.all.iter().map(|member| member.is_binned).collect();
        for &id in ids {
            self.all[id as usize].is_binned = is_binned;
        }
        if self.iter().next().is_none() {
            self.all.iter_mut().zip(before).for_each(|(member, before)| member.is_binned = before);
            return Err(Fault::new(ErrorName::Error, "this is the only model in the cage: open another one"));
        }
        self.join();
        Ok(())
    }

    /// What was said of models meanwhile: what of them is shown, keeps its shape, or stays.
    pub(crate) fn take_choices(&mut self, now: &Self) {
        for (member, now) in self.all.iter_mut().zip(&now.all) {
            member.options.clone_from(&now.options);
            member.painted.clone_from(&now.painted);
        }
    }

    fn join(&mut self) {
        self.positions.clear();
        self.triangles.clear();
        for member in &mut self.all {
            (member.vertices, member.triangles) = (0..0, 0..0);
            if member.is_binned {
                continue;
            }
            let Model { positions, triangles, .. } = &*member.model;
            let (v, t) = (self.positions.len(), self.triangles.len());
            self.positions.extend(positions);
            self.triangles.extend(triangles.iter().map(|corners| corners.map(|c| v as u32 + c)));
            member.vertices = v..self.positions.len();
            member.triangles = t..self.triangles.len();
        }
    }

    /// Those in the cage.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &Member> {
        self.all.iter().filter(|member| !member.is_binned)
    }

    /// One of them by its number.
    ///
    /// # Errors
    /// When it is not in the cage.
    pub(crate) fn get(&self, id: u32) -> Answer<&Member> {
        self.iter().find(|member| member.id == id).ok_or_else(no_model)
    }

    pub(crate) fn get_mut(&mut self, id: u32) -> Answer<&mut Member> {
        let found = self.all.iter_mut().find(|member| member.id == id && !member.is_binned);
        found.ok_or_else(no_model)
    }

    /// The first one.
    ///
    /// # Errors
    /// When there is none.
    pub(crate) fn first(&self) -> Answer<&Member> {
        self.iter().next().ok_or_else(no_model)
    }

    /// What all positions are seen from, in the files' axes: that of the first model, even if it is taken out later.
    pub(crate) fn origin(&self) -> DVec3 {
        self.all.first().map_or(DVec3::ZERO, |member| member.model.origin())
    }

    /// What the page should say of an origin that is not the world's.
    pub(crate) fn place_notice(&self) -> Option<String> {
        let [x, y, z] = self.up().vector_turned(self.origin()).to_array();
        (self.origin() != DVec3::ZERO).then(|| {
            format!(
                "the model is far from the world's origin: coordinates are shown as seen from {x}, {y}, {z}, and files keep \
                 those of the world"
            )
        })
    }

    /// What points up in the files: in all of them the same.
    pub(crate) fn up(&self) -> UpAxis {
        self.iter().next().map_or_else(UpAxis::default, |member| member.model.up())
    }

    /// The models as they are drawn, as one.
    pub(crate) fn draw(&self) -> Arc<DrawModel> {
        let all: Vec<&Arc<DrawModel>> = self.iter().map(|member| &member.draw).collect();
        match all[..] {
            [only] => Arc::clone(only),
            _ => Arc::new(DrawModel::joined(&all.iter().map(|draw| &***draw).collect::<Vec<_>>())),
        }
    }

    /// Triangles of those that are not shown.
    pub(crate) fn hidden(&self) -> Vec<Range<u32>> {
        let hidden = self.iter().filter(|member| !member.options.shown);
        hidden.map(|member| member.triangles.start as u32..member.triangles.end as u32).collect()
    }

    /// Triangles of those that are shown, with their places among all.
    pub(crate) fn shown_triangles(&self) -> impl Iterator<Item = (u32, [u32; 3])> {
        let shown = self.iter().filter(|member| member.options.shown);
        shown.flat_map(|member| {
            (member.triangles.start as u32..).zip(self.triangles[member.triangles.clone()].iter().copied())
        })
    }

    /// Corners of a triangle of a point of the surface; none if it is of a model that is not in the cage.
    pub(crate) fn corners(&self, triangle: u32) -> Option<[u32; 3]> {
        let place = |member: &Member| {
            let own = triangle.checked_sub(member.first_triangle)? as usize;
            self.triangles[member.triangles.clone()].get(own).copied()
        };
        self.iter().find_map(place)
    }

    /// What a triangle of the mesh is counted as in points of the surface.
    pub(crate) fn counted(&self, triangle: u32) -> u32 {
        let of = |member: &&Member| member.triangles.contains(&(triangle as usize));
        self.iter()
            .find(of)
            .map_or(triangle, |member| member.first_triangle + triangle - member.triangles.start as u32)
    }

    /// Points that are bound besides the vertices: those of the first model's rig, then the next one's.
    ///
    /// # Errors
    /// When a rig cannot be read.
    pub(crate) fn extra_points(&self) -> Answer<Vec<Vec3>> {
        let mut points = Vec::new();
        for member in self.iter() {
            points.extend(member.model.extra_points()?);
        }
        Ok(points)
    }

    /// Which of them are one model's.
    ///
    /// # Errors
    /// When a rig cannot be read.
    pub(crate) fn extra_of(&self, id: u32) -> Answer<Range<usize>> {
        let mut first = 0;
        for member in self.iter() {
            let n = member.model.extra_points()?.len();
            if member.id == id {
                return Ok(first..first + n);
            }
            first += n;
        }
        Err(no_model())
    }

    /// What of all models the cage does not bend.
    pub(crate) fn parts(&self) -> Parts {
        let mut all = Parts::default();
        for member in self.iter() {
            // Names were looked at when they were taken.
            let own = member.parts().unwrap_or_default();
            if !own.stays.is_empty() {
                all.stays.resize(self.positions.len(), 0.0);
                all.stays[member.vertices.clone()].copy_from_slice(&own.stays);
            }
            let first = member.vertices.start as u32;
            all.rigid
                .extend(own.rigid.into_iter().map(|piece| piece.into_iter().map(|v| first + v).collect()));
        }
        all
    }

    /// What a project keeps of them; nothing if there is nothing to say.
    pub(crate) fn settings(&self) -> Vec<MemberSettings> {
        let of = |member: &Member| MemberSettings {
            first_triangle: member.first_triangle,
            options: member.options.clone(),
            painted: member.painted.chunk_by(|a, b| a == b).map(|run| (run[0], run.len() as u32)).collect(),
        };
        let all: Vec<_> = self.iter().map(of).collect();
        if all == [MemberSettings::default()] { Vec::new() } else { all }
    }
}

impl Member {
    /// Whether a name is that of a part of it.
    fn selects(&self, name: &str) -> bool {
        name == WHOLE || self.model.select(name).is_ok()
    }

    /// Takes other options.
    ///
    /// # Errors
    /// When a name is that of no part; nothing changes then.
    pub(crate) fn set_options(&mut self, options: PartOptions) -> Answer<()> {
        for name in options.rigid.iter().chain(&options.stays).filter(|name| *name != WHOLE) {
            self.model.select(name).map_err(|e| Fault::new(ErrorName::Error, e))?;
        }
        self.options = options;
        Ok(())
    }

    /// What of it the cage does not bend. `[n_vertices]` of its own
    ///
    /// # Errors
    /// When a name is that of no part.
    pub(crate) fn parts(&self) -> Answer<Parts> {
        let of_parts = |names: &[String]| -> Vec<String> {
            names.iter().filter(|name| *name != WHOLE).cloned().collect()
        };
        let is_whole = |names: &[String]| names.iter().any(|name| name == WHOLE);
        let PartOptions { rigid, stays, .. } = &self.options;
        let named: Vec<(String, f32)> = of_parts(stays).into_iter().map(|name| (name, 1.0)).collect();
        let parts = self.model.parts(&named, &of_parts(rigid));
        let mut parts = parts.map_err(|e| Fault::new(ErrorName::Error, e))?;
        let n = self.model.positions.len();
        if is_whole(rigid) {
            // One piece, although it may be several: a whole suit of armour goes along as one.
            parts.rigid = vec![(0..n as u32).collect()];
        }
        if is_whole(stays) {
            parts.stays = vec![1.0; n];
        }
        if !self.painted.is_empty() {
            parts.stays.resize(n, 0.0);
            let painted = self.painted.iter().map(|&amount| f32::from(amount) / 255.0);
            parts.stays.iter_mut().zip(painted).for_each(|(stays, painted)| *stays = stays.max(painted));
        }
        Ok(parts)
    }

    /// Its share of a list of something of all vertices.
    pub(crate) fn share<'a, T>(&self, of_all: &'a [T]) -> &'a [T] {
        &of_all[self.vertices.clone()]
    }
}

fn no_model() -> Fault {
    Fault::missing("such model", "open one first")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron `at` a place, of a material each for its first two triangles and the rest.
    fn model(name: &str, at: f32) -> Model {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mut text = String::new();
        for [x, y, z] in corners {
            text += &format!("v {} {y} {z}\n", x + at);
        }
        text += "usemtl skin\nf 1 3 2\nusemtl cloth\nf 1 2 4\nf 2 3 4\n";
        let mut model = Model::read(name, text.as_bytes(), &mut |_| None).unwrap();
        model.see_from(DVec3::ZERO);
        model
    }

    fn draw(model: &Model) -> DrawModel {
        DrawModel::plain(model.positions.clone(), model.triangles.clone())
    }

    fn three() -> Models {
        let mut models = Models::default();
        for (name, at) in [("body.obj", 0.0), ("shirt.obj", 10.0), ("hat.obj", 20.0)] {
            let model = model(name, at);
            let draw = draw(&model);
            models.add([(model, draw, None)]);
        }
        models
    }

    /// A model as a project that kept it brings it.
    fn again((member, settings): (&Member, &MemberSettings)) -> (Model, DrawModel, Option<MemberSettings>) {
        ((*member.model).clone(), draw(&member.model), Some(settings.clone()))
    }

    fn names(models: &Models) -> Vec<&str> {
        models.iter().map(|member| member.model.name.as_str()).collect()
    }

    #[test]
    fn points_of_the_surface_mean_the_same_triangle_whatever_comes_and_goes() {
        let mut models = three();
        let of_hat = 7;
        let at = |models: &Models| models.corners(of_hat).map(|c| c.map(|v| models.positions[v as usize]));
        let before = at(&models).unwrap();
        models.bin(&[1], true).unwrap();
        assert_eq!((names(&models), models.triangles.len()), (vec!["body.obj", "hat.obj"], 6));
        assert_eq!(at(&models).unwrap(), before);
        assert_eq!(models.counted(4), of_hat, "the hat's second triangle is the fifth of the mesh now");
        assert_eq!(models.corners(4), None, "the shirt is not in the cage");
        models.bin(&[1], false).unwrap();
        assert_eq!(names(&models), ["body.obj", "shirt.obj", "hat.obj"]);
        assert_eq!((at(&models).unwrap(), models.counted(of_hat)), (before, of_hat));
        // A project has only what is in the cage; its points are counted as they were.
        models.bin(&[0], true).unwrap();
        let saved = models.settings();
        let mut opened = Models::default();
        opened.add(models.iter().zip(&saved).map(again));
        assert_eq!(at(&opened).unwrap(), before);
    }

    /// What was chosen while another change went to the GPU.
    #[test]
    fn choices_that_were_made_meanwhile_are_kept() {
        let mut now = three();
        let mut later = now.clone();
        later.bin(&[1], true).unwrap();
        now.get_mut(2).unwrap().options.shown = false;
        now.get_mut(0).unwrap().painted = vec![255, 0, 0, 0];
        later.take_choices(&now);
        assert_eq!(names(&later), ["body.obj", "hat.obj"]);
        assert!(!later.get(2).unwrap().options.shown);
        assert_eq!(later.get(0).unwrap().painted, [255, 0, 0, 0]);
    }

    #[test]
    fn the_last_model_stays() {
        let mut models = three();
        models.bin(&[0], true).unwrap();
        models.bin(&[2], true).unwrap();
        let error = models.bin(&[1], true).unwrap_err();
        assert!(error.message().contains("only model"), "{}", error.message());
        assert!(models.bin(&[9], true).is_err());
        assert_eq!(names(&models), ["shirt.obj"]);
    }

    #[test]
    fn models_in_one_cage_have_the_origin_of_the_first() {
        let at = |name: &str, x: f64| {
            let text = format!("v {} 0 0\nv {} 0 0\nv {x} 1 0\nf 1 2 3\n", x + 0.25, x + 1.0);
            Model::read(name, text.as_bytes(), &mut |_| None).unwrap()
        };
        let mut models = Models::default();
        assert_eq!((models.origin(), models.place_notice()), (DVec3::ZERO, None));
        for mut one in [at("a.obj", 4.5e6), at("b.obj", 4.6e6)] {
            if !models.positions.is_empty() {
                one.see_from(models.origin());
            }
            let draw = draw(&one);
            models.add([(one, draw, None)]);
        }
        let origin = models.origin();
        assert_eq!(models.positions[3].as_dvec3().x + origin.x, 4.6e6 + 0.25);
        models.bin(&[0], true).unwrap();
        assert_eq!(models.origin(), origin, "the cage stays where it is");
        assert!(models.place_notice().unwrap().contains("seen from 4500000.5, 0, 0"));
    }

    #[test]
    fn parts_are_named_painted_and_kept_in_settings() {
        let mut models = three();
        assert!(models.parts().is_empty());
        let options = |rigid: &[&str], stays: &[&str]| PartOptions {
            rigid: rigid.iter().map(|&s| s.to_owned()).collect(),
            stays: stays.iter().map(|&s| s.to_owned()).collect(),
            ..PartOptions::default()
        };
        models.get_mut(0).unwrap().set_options(options(&[], &["material:skin"])).unwrap();
        models.get_mut(1).unwrap().set_options(options(&["all"], &[])).unwrap();
        let hat = models.get_mut(2).unwrap();
        let error = hat.set_options(options(&["material:gold"], &[])).unwrap_err();
        assert!(error.message().contains("material:skin"), "it names what there is: {}", error.message());
        assert_eq!(hat.options, PartOptions::default());
        hat.painted = vec![0, 255, 255, 51];
        let expected = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.2];
        let parts = models.parts();
        assert_eq!((parts.stays.as_slice(), &parts.rigid), (&expected[..], &vec![vec![4, 5, 6, 7]]));
        // Through JSON, as a project keeps them.
        let text = serde_json::to_string(&models.settings()).unwrap();
        let saved: Vec<MemberSettings> = serde_json::from_str(&text).unwrap();
        let mut opened = Models::default();
        opened.add(models.iter().zip(&saved).map(again));
        assert_eq!(opened.parts(), parts);
        assert_eq!(opened.settings(), saved);
        // What another program wrote is left out as far as it does not fit.
        let odd = r#"{"first_triangle": 4294967295, "options": {"rigid": ["nobody"]}, "painted": [[255, 4000000000]]}"#;
        let mut other = Models::default();
        let odd: MemberSettings = serde_json::from_str(odd).unwrap();
        other.add([(model("a.obj", 0.0), draw(&model("a.obj", 0.0)), Some(odd.clone()))]);
        // A second one once ended in a panic: it is counted on from the first.
        other.add([(model("b.obj", 0.0), draw(&model("b.obj", 0.0)), Some(odd.clone()))]);
        assert!(other.parts().is_empty());
        assert_eq!(other.settings().len(), 2);
        assert_eq!([MAX_FIRST, MAX_FIRST + 3].map(|t| other.corners(t)), [Some([0, 2, 1]), Some([4, 6, 5])]);
    }

    #[test]
    fn one_model_has_nothing_to_keep() {
        let mut models = Models::default();
        models.add([(model("a.obj", 0.0), draw(&model("a.obj", 0.0)), None)]);
        assert_eq!(models.settings(), Vec::new());
    }
}
