//! Shortest paths through the voxels of a solid.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::DVec3;

/// Number of voxels in each direction within which the largest distance to the surface is the local thickness.
const THICKNESS_REACH: usize = 3;

/// Additional cost of a step at the surface, in lengths of the step. In the middle of the local thickness, a step costs
/// its length.
const SURFACE_COST: f64 = 30.0;

/// Marks voxels outside the solid.
const NONE: u32 = u32::MAX;

/// Voxels of a solid as a graph: each has edges to up to 26 neighbours.
#[derive(Debug)]
pub(super) struct Solid {
    dims: [usize; 3],
    pub(super) voxels: Vec<[usize; 3]>,
    /// Number of each voxel of the box in `voxels`, or [`NONE`].
    number: Vec<u32>,
    /// Distance of each voxel of the solid to the nearest voxel outside, in voxels. `[n_voxels]`
    pub(super) radius: Vec<f64>,
    /// Cost of a step of length 1 at each voxel.
    price: Vec<f64>,
}

/// Result of a search: for each voxel the distance and the previous voxel, and the voxel at which it stopped.
pub(super) struct Search {
    pub(super) distance: Vec<f64>,
    previous: Vec<u32>,
    end: Option<u32>,
}

/// Entry of the queue: the smallest cost is the greatest entry.
#[derive(PartialEq)]
struct Step(f64, u32);

impl Eq for Step {}

impl Ord for Step {
    fn cmp(&self, other: &Self) -> Ordering {
        other.0.total_cmp(&self.0).then(other.1.cmp(&self.1))
    }
}

impl PartialOrd for Step {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Search {
    /// Voxels from the one at which the search stopped back to its start.
    pub(super) fn path(&self) -> Vec<u32> {
        let previous = |&v: &u32| Some(self.previous[v as usize]).filter(|&v| v != NONE);
        std::iter::successors(self.end, previous).collect()
    }

    /// Copies the values of the starts, the voxels without a previous one, to the voxels that were reached from them.
    pub(super) fn spread(&self, values: &mut [u32]) {
        let mut order: Vec<usize> = (0..values.len()).filter(|&v| self.previous[v] != NONE).collect();
        order.sort_by(|&a, &b| self.distance[a].total_cmp(&self.distance[b]));
        for v in order {
            values[v] = values[self.previous[v] as usize];
        }
    }
}

impl Solid {
    pub(super) fn new(dims: [usize; 3], voxels: Vec<[usize; 3]>) -> Self {
        let n = dims.iter().product();
        let mut solid = Self { dims, voxels, number: vec![NONE; n], radius: Vec::new(), price: Vec::new() };
        let mut squared = vec![0.0; n];
        for (voxel, number) in solid.voxels.iter().zip(0..) {
            let slot = solid.slot(*voxel);
            solid.number[slot] = number;
            squared[slot] = f64::MAX;
        }
        solid.for_each_line(&mut squared, squared_distances);
        let all: Vec<f64> = squared.iter().map(|squared| squared.sqrt()).collect();
        let mut thickness = all.clone();
        solid.for_each_line(&mut thickness, |line| {
            let of =
                |k: usize| &line[k.saturating_sub(THICKNESS_REACH)..line.len().min(k + THICKNESS_REACH + 1)];
            (0..line.len()).map(|k| of(k).iter().copied().fold(0.0, f64::max)).collect()
        });
        let slots: Vec<usize> = solid.voxels.iter().map(|&voxel| solid.slot(voxel)).collect();
        solid.radius = slots.iter().map(|&slot| all[slot]).collect();
        let price = |slot: usize| 1.0 + SURFACE_COST * (1.0 - all[slot] / thickness[slot].max(1.0)).powi(2);
        solid.price = slots.into_iter().map(price).collect();
        solid
    }

    fn slot(&self, [x, y, z]: [usize; 3]) -> usize {
        (x * self.dims[1] + y) * self.dims[2] + z
    }

    /// Number of a voxel in the solid; `None` if it is outside.
    pub(super) fn find(&self, voxel: [usize; 3]) -> Option<u32> {
        let is_in_box = voxel.iter().zip(&self.dims).all(|(x, n)| x < n);
        Some(*self.number.get(self.slot(voxel))?).filter(|&number| is_in_box && number != NONE)
    }

    /// Image of a voxel about the middle of an axis; `None` if it is outside the solid.
    pub(super) fn image(&self, number: u32, axis: usize) -> Option<u32> {
        let mut voxel = self.voxels[number as usize];
        voxel[axis] = self.dims[axis] - 1 - voxel[axis];
        self.find(voxel)
    }

    pub(super) fn distance(&self, a: u32, b: u32) -> f64 {
        let at = |v: u32| DVec3::from_array(self.voxels[v as usize].map(|x| x as f64));
        at(a).distance(at(b))
    }

    /// Replaces the values on each line of voxels along x, y and z.
    fn for_each_line(&self, values: &mut [f64], line: impl Fn(&[f64]) -> Vec<f64>) {
        for axis in 0..3 {
            let mut first = self.dims;
            first[axis] = 1;
            let stride = self.dims[axis + 1..].iter().product::<usize>();
            for x in 0..first[0] {
                for y in 0..first[1] {
                    for z in 0..first[2] {
                        let from = self.slot([x, y, z]);
                        let slots = (0..self.dims[axis]).map(|k| from + k * stride);
                        let old: Vec<f64> = slots.clone().map(|slot| values[slot]).collect();
                        for (slot, new) in slots.zip(line(&old)) {
                            values[slot] = new;
                        }
                    }
                }
            }
        }
    }

    /// Calls `each` for every voxel within `radius` of a voxel.
    pub(super) fn for_each_near(&self, center: u32, radius: f64, mut each: impl FnMut(u32)) {
        let reach = radius.ceil() as usize;
        let at = self.voxels[center as usize];
        let range = |k: usize| at[k].saturating_sub(reach)..(at[k] + reach + 1).min(self.dims[k]);
        for x in range(0) {
            for y in range(1) {
                for z in range(2) {
                    if let Some(v) = self.find([x, y, z])
                        && self.distance(center, v) < radius
                    {
                        each(v);
                    }
                }
            }
        }
    }

    /// Dijkstra's search from voxels with the given distances. Stops at the first voxel for which `is_end` is true.
    /// `is_priced`: whether steps far from the middle of the local thickness cost more than their length.
    pub(super) fn search(
        &self,
        starts: impl IntoIterator<Item = (u32, f64)>,
        is_priced: bool,
        is_end: impl Fn(u32) -> bool,
    ) -> Search {
        let n = self.voxels.len();
        let mut search = Search { distance: vec![f64::INFINITY; n], previous: vec![NONE; n], end: None };
        let mut queue = BinaryHeap::new();
        for (start, distance) in starts {
            if distance < search.distance[start as usize] {
                search.distance[start as usize] = distance;
                queue.push(Step(distance, start));
            }
        }
        while let Some(Step(distance, v)) = queue.pop() {
            if distance > search.distance[v as usize] {
                continue;
            }
            if is_end(v) {
                search.end = Some(v);
                break;
            }
            let [x, y, z] = self.voxels[v as usize];
            for k in (0..27).filter(|&k| k != 13) {
                let step = [k / 9, k / 3 % 3, k % 3];
                // The outermost layer of the box is empty, so that all neighbours are in the box.
                let next = self.number[self.slot([x + step[0] - 1, y + step[1] - 1, z + step[2] - 1])];
                if next == NONE {
                    continue;
                }
                let length = (step.iter().filter(|&&s| s != 1).count() as f64).sqrt();
                let price = |v: u32| self.price[v as usize];
                let cost = if is_priced { length * 0.5 * (price(v) + price(next)) } else { length };
                if distance + cost < search.distance[next as usize] {
                    search.distance[next as usize] = distance + cost;
                    search.previous[next as usize] = v;
                    queue.push(Step(distance + cost, next));
                }
            }
        }
        search
    }
}

/// Computes `min_j (i - j)^2 + f_j` for each i.
///
/// Source: Felzenszwalb and Huttenlocher 2012, "Distance transforms of sampled functions" (lower envelope of parabolas).
fn squared_distances(f: &[f64]) -> Vec<f64> {
    let crossing = |a: usize, b: usize| {
        let (x, y) = (a as f64, b as f64);
        ((f[b] + y * y) - (f[a] + x * x)) / (2.0 * (y - x))
    };
    // Parabolas of the envelope, each with the place from which it is the lowest.
    let mut envelope: Vec<(usize, f64)> = Vec::new();
    for k in (0..f.len()).filter(|&k| f[k] < f64::MAX) {
        while let [.., (last, from)] = envelope[..]
            && crossing(last, k) <= from
        {
            envelope.pop();
        }
        let from = envelope.last().map_or(f64::NEG_INFINITY, |&(last, _)| crossing(last, k));
        envelope.push((k, from));
    }
    let mut at = 0;
    let value = |k: usize| {
        while at + 1 < envelope.len() && envelope[at + 1].1 < k as f64 {
            at += 1;
        }
        envelope.get(at).map_or(f64::MAX, |&(j, _)| (k as f64 - j as f64).powi(2) + f[j])
    };
    (0..f.len()).map(value).collect()
}
