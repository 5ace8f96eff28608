use nalgebra::Matrix3;

/// The XYZ Euler angles of a rotation matrix, in radians, as the observations hold them.
///
/// Near the singularity, where the cosine of the second angle vanishes, the first is taken as 0.
///
/// Source: `mat2euler` of gymnasium-robotics 1.4.2, operation for operation, so that it is equal
/// to the last bit; the convention is transforms3d's, with the signs turned.
pub(crate) fn matrix_to_euler(matrix: &Matrix3<f64>) -> [f64; 3] {
    const SINGULAR: f64 = 4.0 * f64::EPSILON;
    let m = |row, column| matrix[(row, column)];
    let cos_y = (m(2, 2) * m(2, 2) + m(1, 2) * m(1, 2)).sqrt();
    let y = -(-m(0, 2)).atan2(cos_y);
    if cos_y > SINGULAR {
        [-m(1, 2).atan2(m(2, 2)), y, -m(0, 1).atan2(m(0, 0))]
    } else {
        [0.0, y, -(-m(1, 0)).atan2(m(1, 1))]
    }
}
