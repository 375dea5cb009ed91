//! Uniform grid of triangles for neighbour queries. Lists grow as triangles move; stale entries are removed on reading.

use glam::DVec3;

/// Edge of a bucket in voxels.
const BUCKET_EDGE: f64 = 4.0;

#[derive(Debug)]
pub(super) struct Buckets {
    origin: DVec3,
    dims: [usize; 3],
    lists: Vec<Vec<u32>>,
    /// Two stamps per triangle, which prevent duplicates: the value of `lists_read` when a list last contained the
    /// triangle, and the value of `searches` when a search last found it.
    met: Vec<(u32, u32)>,
    lists_read: u32,
    searches: u32,
    /// Number of lists that searches have read, plus the number of their entries: the work of all searches.
    pub(super) visits: u64,
}

impl Buckets {
    /// Creates an empty grid of size `2 * half` around the origin, for `n` triangles.
    pub(super) fn new(half: DVec3, n: usize) -> Self {
        let dims = half.to_array().map(|h| (2.0 * h / BUCKET_EDGE).ceil() as usize + 1);
        Self {
            origin: -half,
            dims,
            lists: vec![Vec::new(); dims.iter().product()],
            met: vec![(0, 0); n],
            lists_read: 0,
            searches: 0,
            visits: 0,
        }
    }

    fn slot(&self, x: usize, y: usize, z: usize) -> usize {
        (z * self.dims[1] + y) * self.dims[0] + x
    }

    pub(super) fn add(&mut self, triangle: u32, min: DVec3, max: DVec3) {
        let [xs, ys, zs] = range(self.origin, self.dims, min, max);
        for z in zs[0]..=zs[1] {
            for y in ys[0]..=ys[1] {
                for x in xs[0]..=xs[1] {
                    let slot = self.slot(x, y, z);
                    self.lists[slot].push(triangle);
                }
            }
        }
    }

    /// Writes to `found` all triangles whose box overlaps `min`..`max`, each once. `bounds`: current box of a triangle,
    /// or `None` if the triangle has been removed.
    pub(super) fn near(
        &mut self,
        min: DVec3,
        max: DVec3,
        bounds: impl Fn(u32) -> Option<(DVec3, DVec3)>,
        found: &mut Vec<u32>,
    ) {
        found.clear();
        self.searches += 1;
        let (origin, dims, searches) = (self.origin, self.dims, self.searches);
        let all = &mut self.met;
        let [xs, ys, zs] = range(origin, dims, min, max);
        for z in zs[0]..=zs[1] {
            for y in ys[0]..=ys[1] {
                for x in xs[0]..=xs[1] {
                    let slot = (z * dims[1] + y) * dims[0] + x;
                    let bucket = bucket_bounds(origin, dims, [x, y, z]);
                    let mut list = std::mem::take(&mut self.lists[slot]);
                    self.lists_read += 1;
                    self.visits += 1 + list.len() as u64;
                    let read = self.lists_read;
                    list.retain(|&t| {
                        let Some((low, high)) = bounds(t) else { return false };
                        let met = &mut all[t as usize];
                        if met.0 == read {
                            return false;
                        }
                        met.0 = read;
                        if met.1 != searches && low.cmple(max).all() && high.cmpge(min).all() {
                            met.1 = searches;
                            found.push(t);
                        }
                        low.cmple(bucket[1]).all() && high.cmpge(bucket[0]).all()
                    });
                    self.lists[slot] = list;
                }
            }
        }
    }
}

/// Returns the range of buckets along each axis that a box overlaps, clamped to the grid.
fn range(origin: DVec3, dims: [usize; 3], min: DVec3, max: DVec3) -> [[usize; 2]; 3] {
    [0, 1, 2].map(|k| {
        let at = |p: DVec3| (((p[k] - origin[k]) / BUCKET_EDGE).max(0.0) as usize).min(dims[k] - 1);
        [at(min), at(max)]
    })
}

/// Returns the box of a bucket. Outermost buckets extend to infinity.
fn bucket_bounds(origin: DVec3, dims: [usize; 3], at: [usize; 3]) -> [DVec3; 2] {
    let [mut min, mut max] = [DVec3::NEG_INFINITY, DVec3::INFINITY];
    for k in 0..3 {
        if at[k] > 0 {
            min[k] = origin[k] + BUCKET_EDGE * at[k] as f64;
        }
        if at[k] + 1 < dims[k] {
            max[k] = origin[k] + BUCKET_EDGE * (at[k] + 1) as f64;
        }
    }
    [min, max]
}
