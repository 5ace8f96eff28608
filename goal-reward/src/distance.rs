//! The Euclidean distance between two goals, equal to numpy's to the last bit.

/// Returns the Euclidean distance between two goals, in the goals' unit (meters for Fetch).
///
/// Each slice holds one goal. The distance between two empty goals is 0. Goals of different lengths
/// have no distance: the result is NaN, which no reward function counts as a success
/// ([`check_goals`](crate::check_goals) returns an error instead).
///
/// # Precision
/// Equal, bit for bit, to `numpy.linalg.norm(a - b, axis=-1)` on `float64`: numpy adds at most
/// seven squares from left to right, and more by pairwise summation in eight running sums, split in
/// halves above 128 elements. As in numpy, distances above about 1e154 overflow to infinity.
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

/// [`goal_distance`] without a branch, for the length of every Fetch goal.
#[inline(always)]
pub(crate) fn distance_3d(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    let [x, y, z] = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    (x * x + y * y + z * z).sqrt()
}

/// The number of numpy's running sums.
const LANES: usize = 8;
/// The longest run that numpy adds without splitting it.
const BLOCK: usize = 128;

/// Returns the sum of squared differences, in numpy's order of additions. The slices have equal
/// lengths.
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
