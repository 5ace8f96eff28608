use nalgebra::Matrix3;

/// The XYZ Euler angles of a rotation matrix, in radians, as the observations hold them.
///
/// Near the singularity, where the cosine of the second angle vanishes, the first is taken as 0.
///
/// Source: `mat2euler` of gymnasium-robotics 1.4.2, operation for operation. It is equal to the
/// last bit where numpy calls the C library's arctangent; numpy's own for AVX-512 gives another last
/// bit for one number in thirteen.
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use serde::Deserialize;

    use super::*;

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
    fn every_recorded_angle_of_the_reference_is_reproduced_to_the_last_bit() {
        let recording = include_str!("../../tests/fixtures/mat2euler.json");
        let recording: Recording = serde_json::from_str(recording).expect("the fixture's format");
        assert!(recording.cases.len() > 30);
        for Case { matrix, euler } in recording.cases {
            let angles = matrix_to_euler(&Matrix3::from_row_slice(&matrix));
            assert_eq!(angles.map(f64::to_bits), euler.map(f64::to_bits), "{matrix:?}");
        }
    }

    proptest! {
        /// The definition: turning about the fixed axes z, y and x, in this order, is the rotation.
        #[test]
        fn the_angles_compose_to_the_rotation(axis in prop::array::uniform3(-3.0..3.0_f64)) {
            use nalgebra::{Rotation3, Vector3};
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
