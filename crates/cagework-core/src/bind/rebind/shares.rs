//! How much every column takes of the few fields that are solved for.

use crate::solve::rows::{LANES, Row};

use super::known::Known;
use super::local::Negligible;

/// Shares of all columns in some fields.
#[derive(Clone, Debug)]
pub(super) struct Shares {
    n_fields: usize,
    /// Of a row of all columns.
    n_batches: usize,
    /// `[n_fields][n_batches]`
    columns: Vec<Row>,
    /// Value of each field below which no column feels it; infinite for a last batch's lanes without a field.
    /// `[n_batches of fields]`
    pub(super) unfelt: Vec<Row>,
    /// Fields that are there already.
    pub(super) known: Known,
}

/// Fields that are felt somewhere, and their values there.
#[derive(Debug)]
pub(super) struct Felt {
    /// `[.. n]` are those; room for all.
    list: Vec<(u32, f32)>,
    n: usize,
}

impl Shares {
    /// None yet but the known ones, for rows of so many batches.
    pub(super) fn new(n_batches: usize, known: Known) -> Self {
        Self { n_fields: 0, n_batches, columns: Vec::new(), unfelt: Vec::new(), known }
    }

    /// Adds the shares of a field to be solved for, which is made so much larger that they have a norm of 1, and returns how much:
    /// then the field's norm is what it changes all columns by.
    pub(super) fn push(&mut self, mut share: Vec<Row>, negligible: Negligible) -> f32 {
        let squares = share.iter().flatten().map(|&w| f64::from(w).powi(2)).sum::<f64>();
        let norm = (squares.sqrt() as f32).max(f32::MIN_POSITIVE);
        let mut largest = f32::MIN_POSITIVE;
        for w in share.iter_mut().flatten() {
            *w /= norm;
            largest = largest.max(w.abs());
        }
        self.columns.extend(share);
        let lane = self.n_fields % LANES;
        if lane == 0 {
            self.unfelt.push([f32::INFINITY; LANES]);
        }
        self.unfelt[self.n_fields / LANES][lane] = negligible.correction / largest;
        self.n_fields += 1;
        norm
    }

    /// Fields to be solved for.
    pub(super) fn len(&self) -> usize {
        self.n_fields
    }

    /// Each field's shares, `[n_batches]`.
    pub(super) fn iter(&self) -> impl Iterator<Item = &[Row]> {
        self.columns.chunks_exact(self.n_batches)
    }

    /// Takes down what is felt of fields with these values: `[n_batches of fields]`.
    #[inline(always)]
    pub(super) fn pick<'a>(&self, felt: &mut Felt, values: impl Iterator<Item = &'a Row>) {
        felt.n = 0;
        felt.list.resize(self.unfelt.len() * LANES, (0, 0.0));
        for ((first, values), unfelt) in (0u32..).step_by(LANES).zip(values).zip(&self.unfelt) {
            let Some(free) = felt.list[felt.n..].first_chunk_mut::<LANES>() else { return };
            let mut n = 0;
            for lane in 0..LANES {
                // Written always, kept if it is felt: nobody can foretell which are. Never more than LANES.
                free[n % LANES] = (first + lane as u32, values[lane]);
                n += usize::from(values[lane].abs() > unfelt[lane]);
            }
            felt.n += n;
        }
    }

    /// Adds what is felt to a row of all columns: four fields at a time, or most of the work would be loading and storing
    /// sums.
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    #[cfg_attr(target_family = "wasm", inline(never))]
    pub(super) fn add(&self, felt: &Felt, out: &mut [Row]) {
        let share = |field: u32| &self.columns[field as usize * self.n_batches..][..self.n_batches];
        let (fours, rest) = felt.list[..felt.n].as_chunks::<4>();
        for four in fours {
            let [a, b, c, d] = four.map(|(field, _)| share(field));
            let [va, vb, vc, vd] = four.map(|(_, value)| value);
            for ((((out, a), b), c), d) in out.iter_mut().zip(a).zip(b).zip(c).zip(d) {
                // In a variable of its own, which no share can be part of: only so are lanes taken together.
                let mut sum = *out;
                for lane in 0..LANES {
                    sum[lane] += va * a[lane] + vb * b[lane] + (vc * c[lane] + vd * d[lane]);
                }
                *out = sum;
            }
        }
        for &(field, value) in rest {
            add_scaled(out, share(field), value);
        }
    }
}

impl Felt {
    /// Nothing yet.
    pub(super) fn new() -> Self {
        Self { list: Vec::new(), n: 0 }
    }

    /// The fields, and their values.
    pub(super) fn iter(&self) -> impl Iterator<Item = (usize, f32)> {
        self.list[..self.n].iter().map(|&(field, value)| (field as usize, value))
    }

    /// Whether nothing is felt.
    pub(super) fn is_empty(&self) -> bool {
        self.n == 0
    }
}

/// `out += value * share`
#[inline(always)]
pub(super) fn add_scaled(out: &mut [Row], share: &[Row], value: f32) {
    for (out, share) in out.iter_mut().zip(share) {
        let mut sum = *out;
        for lane in 0..LANES {
            sum[lane] += value * share[lane];
        }
        *out = sum;
    }
}
