//! Distances equal numpy's to the last bit, in all branches of its summation.

use goal_reward::goal_distance;

/// `bits(numpy.linalg.norm(a - b, axis=-1))` of numpy 2.4.6 for `i = numpy.arange(n)`,
/// `a = ((i * 37 + 11) % 101) / 97.0`, `b = ((i * 53 + 29) % 103) / 89.0`.
const NORMS: [(usize, u64); 20] = [
    (1, 0x3fcb_3141_3558_d00e),
    (2, 0x3fde_7eb1_6ca0_d1f5),
    (3, 0x3fe6_7e12_b9cc_9a87),
    (4, 0x3ff0_502a_a532_837f),
    (7, 0x3ff0_ba4e_7c31_c250),
    (8, 0x3ff1_8023_89be_8b30),
    (9, 0x3ff2_be40_5b24_8ff3),
    (15, 0x3ffb_4a65_ee52_827f),
    (16, 0x3ffd_161e_6b61_da11),
    (17, 0x3ffd_d580_085a_3847),
    (25, 0x4001_468c_debe_0fb8),
    (127, 0x4013_b44f_bc3a_ea46),
    (128, 0x4013_b4d4_2351_fe13),
    (129, 0x4013_b7c7_a551_7b89),
    (130, 0x4013_c6f6_12b8_eafd),
    (200, 0x4019_579c_600c_e26c),
    (256, 0x401c_7b59_96ce_382d),
    (257, 0x401c_b783_6ed9_e299),
    (300, 0x401e_f828_026d_5000),
    (1000, 0x402c_3175_6c94_b918),
];

#[test]
fn distances_have_the_bits_of_numpy() {
    for (dim, expected) in NORMS {
        let goal = |factor: usize, offset: usize, modulus: usize, divisor: f64| -> Vec<f64> {
            (0..dim).map(|i| ((i * factor + offset) % modulus) as f64 / divisor).collect()
        };
        let distance = goal_distance(&goal(37, 11, 101, 97.0), &goal(53, 29, 103, 89.0));
        assert_eq!(distance.to_bits(), expected, "{dim} elements: {distance}");
    }
}

#[test]
fn distances_too_large_to_square_are_infinite_as_in_numpy() {
    assert_eq!(goal_distance(&[1e200, 0.0, 0.0], &[0.0; 3]), f64::INFINITY);
    assert_eq!(goal_distance(&[1e-200, 0.0, 0.0], &[0.0; 3]), 0.0);
}
