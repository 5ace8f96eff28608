//! Euler angles of a rotation.

use nalgebra::Matrix3;

/// Returns the XYZ Euler angles of a rotation matrix, in radians.
///
/// Near the singularity, where the cosine of the second angle vanishes, the first angle is 0.
///
/// Source: `mat2euler` of gymnasium-robotics 1.4.2, operation for operation. The results are equal
/// to the last bit if numpy calls the C library's arctangent; numpy's own for AVX-512 differs in
/// the last bit for one number in thirteen.
pub(super) fn matrix_to_euler(matrix: &Matrix3<f64>) -> [f64; 3] {
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

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation3, Vector3};
    use proptest::prelude::*;
    use serde::Deserialize;

    use super::*;

    type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

    #[derive(Deserialize)]
    struct Recording {
        cases: Vec<Case>,
    }

    #[derive(Deserialize)]
    struct Case {
        matrix: [f64; 9],
        euler: [f64; 3],
    }

    #[test]
    fn every_recorded_angle_of_the_reference_is_reproduced_to_the_last_bit() -> Result {
        let recording = include_str!("../../tests/fixtures/mat2euler.json");
        let recording: Recording = serde_json::from_str(recording)?;
        assert!(recording.cases.len() > 30);
        for Case { matrix, euler } in recording.cases {
            let angles = matrix_to_euler(&Matrix3::from_row_slice(&matrix));
            assert_eq!(angles.map(f64::to_bits), euler.map(f64::to_bits), "{matrix:?}");
        }
        Ok(())
    }

    /// A matrix whose second angle has the cosine `|cos_y|`. Its first and its last angle differ
    /// between the two formulas.
    fn nearly_singular(cos_y: f64) -> Matrix3<f64> {
        Matrix3::new(0.0, 0.0, 1.0, 0.6, 0.8, 0.0, -0.8, 0.6, cos_y)
    }

    #[test]
    fn at_the_singularity_the_first_angle_is_zero_and_the_last_one_is_all() {
        let singular = 4.0 * f64::EPSILON;
        let [x, _, z] = matrix_to_euler(&nearly_singular(singular));
        assert_eq!((x, z), (0.0, 0.6_f64.atan2(0.8)));
        let [x, _, z] = matrix_to_euler(&nearly_singular(-singular.next_up()));
        assert_eq!((x.abs(), z), (std::f64::consts::PI, 0.0));
    }

    proptest! {
        /// The definition: turns about the fixed axes z, y and x, in this order, give the rotation.
        #[test]
        fn the_angles_compose_to_the_rotation(axis in prop::array::uniform3(-3.0..3.0_f64)) {
            let rotation = Rotation3::from_scaled_axis(Vector3::from(axis));
            let [x, y, z] = matrix_to_euler(rotation.matrix());
            let turn = |axis, angle| Rotation3::from_axis_angle(&axis, angle);
            let composed = turn(Vector3::x_axis(), x)
                * turn(Vector3::y_axis(), y)
                * turn(Vector3::z_axis(), z);
            prop_assert!((composed.matrix() - rotation.matrix()).abs().max() < 1e-9);
        }
    }
}
