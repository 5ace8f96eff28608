//! The Euclidean distance of two goals, to numpy's last bit.

/// The Euclidean distance of two goals, in the goals' own unit (meters for Fetch).
///
/// Both slices hold one goal of the same length. Two empty goals are at distance 0. Goals of
/// different lengths have no distance: the result is NaN, which no reward function calls a success
/// ([`check_goals`](crate::check_goals) reports the mistake instead).
///
/// # Precision
/// Equal, bit for bit, to `numpy.linalg.norm(a - b, axis=-1)` on `float64`: numpy adds up to seven
/// squares from left to right, and more by pairwise summation in eight running sums, split in halves
/// beyond 128 elements. Distances above about 1e154 overflow to infinity, there and here.
///
/// # Example
/// ```
/// assert_eq!(goal_reward::goal_distance(&[1.0, 2.0, 2.0], &[0.0, 0.0, 0.0]), 3.0);
/// ```
#[inline]
#[must_use]
pub fn goal_distance(a: &[f64], b: &[f64]) -> f64 {
    if let (&[a0, a1, a2], &[b0, b1, b2]) = (a, b) {
        return distance_3d(&[a0, a1, a2], &[b0, b1, b2]);
    }
    if a.len() != b.len() {
        return f64::NAN;
    }
    sum_of_squares(a, b).sqrt()
}

/// [`goal_distance`] for the length every Fetch goal has, without a branch.
#[inline(always)]
pub(crate) fn distance_3d(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    let [x, y, z] = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    (x * x + y * y + z * z).sqrt()
}

/// How many running sums numpy keeps.
const LANES: usize = 8;
/// The longest run numpy adds without splitting it.
const BLOCK: usize = 128;

/// The sum of squared differences, in numpy's order of additions. The slices are equally long.
fn sum_of_squares(a: &[f64], b: &[f64]) -> f64 {
    if a.len() > BLOCK {
        let middle = a.len() / 2 / LANES * LANES;
        let (a_left, a_right) = a.split_at(middle);
        let (b_left, b_right) = b.split_at(middle);
        return sum_of_squares(a_left, b_left) + sum_of_squares(a_right, b_right);
    }
    let (a_rows, a_rest) = a.as_chunks::<LANES>();
    let (b_rows, b_rest) = b.as_chunks::<LANES>();
    let mut lanes = [0.0; LANES];
    for (a_row, b_row) in a_rows.iter().zip(b_rows) {
        for lane in 0..LANES {
            lanes[lane] += square(a_row[lane] - b_row[lane]);
        }
    }
    let [s0, s1, s2, s3, s4, s5, s6, s7] = lanes;
    let lanes = ((s0 + s1) + (s2 + s3)) + ((s4 + s5) + (s6 + s7));
    a_rest.iter().zip(b_rest).fold(lanes, |sum, (a, b)| sum + square(a - b))
}

#[inline(always)]
fn square(x: f64) -> f64 {
    x * x
}
