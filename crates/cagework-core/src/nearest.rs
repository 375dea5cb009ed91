//! Nearest neighbour search in a k-d tree (Bentley 1975, "Multidimensional binary search trees").

use glam::Vec3;

/// Implicit k-d tree: the median of each range splits it, along x, y and z cyclically.
#[derive(Clone, Debug)]
pub struct KdTree<'a> {
    points: &'a [Vec3],
    order: Vec<u32>,
}

impl<'a> KdTree<'a> {
    /// Builds the tree of the points with the indices `order`.
    #[must_use]
    pub fn new(points: &'a [Vec3], mut order: Vec<u32>) -> Self {
        sort(points, &mut order, 0);
        Self { points, order }
    }

    /// Finds the index and squared distance of the point nearest to `at`. `None` if this distance is not below `limit`
    /// (squared).
    #[must_use]
    pub fn find(&self, at: Vec3, limit: f32) -> Option<(u32, f32)> {
        let mut best = (u32::MAX, limit);
        self.search(&self.order, 0, at, &mut best);
        (best.0 != u32::MAX).then_some(best)
    }

    fn search(&self, order: &[u32], axis: usize, at: Vec3, best: &mut (u32, f32)) {
        let middle = order.len() / 2;
        let Some(&i) = order.get(middle) else { return };
        let point = self.points[i as usize];
        let squared = point.distance_squared(at);
        if squared < best.1 {
            *best = (i, squared);
        }
        let beyond = at[axis] - point[axis];
        let [low, high] = [&order[..middle], &order[middle + 1..]];
        let [near, far] = if beyond < 0.0 { [low, high] } else { [high, low] };
        self.search(near, (axis + 1) % 3, at, best);
        if beyond * beyond < best.1 {
            self.search(far, (axis + 1) % 3, at, best);
        }
    }
}

fn sort(points: &[Vec3], order: &mut [u32], axis: usize) {
    if order.len() > 1 {
        let middle = order.len() / 2;
        let by = |a: &u32, b: &u32| points[*a as usize][axis].total_cmp(&points[*b as usize][axis]);
        order.select_nth_unstable_by(middle, by);
        let (low, high) = order.split_at_mut(middle);
        sort(points, low, (axis + 1) % 3);
        sort(points, &mut high[1..], (axis + 1) % 3);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_point_is_that_of_brute_force() {
        let points: Vec<Vec3> = (0..200_u32)
            .map(|i| Vec3::new((i * 73 % 101) as f32, (i * 37 % 89) as f32, (i * 11 % 53) as f32))
            .collect();
        let nearest = KdTree::new(&points, (0..200).collect());
        for at in [Vec3::ZERO, Vec3::splat(40.5), Vec3::new(90.0, 3.0, 200.0)] {
            let all = points.iter().map(|p| p.distance_squared(at)).fold(f32::INFINITY, f32::min);
            assert_eq!(nearest.find(at, f32::INFINITY).map(|found| found.1), Some(all));
            assert_eq!(nearest.find(at, all), None, "no point is nearer than the nearest");
        }
    }
}
