//! The hyperbolic tangent at the end of an actor.

/// Returns the hyperbolic tangent, with the same bits on each processor and operating system: their
/// C libraries differ in last bits.
///
/// It is computed in double precision and rounded once, so that other exact code gets the same
/// bits.
pub(crate) fn tanh(value: f32) -> f32 {
    libm::tanh(f64::from(value)) as f32
}

#[cfg(test)]
mod tests {
    use super::tanh;

    #[test]
    fn it_is_rounded_from_double_precision() {
        for value in (-2000..=2000).map(|number| 0.007 * number as f32) {
            let exact = f64::from(value).tanh();
            assert!((f64::from(tanh(value)) - exact).abs() <= f64::from(f32::EPSILON) / 4.0);
        }
        assert_eq!([0.0, -20.0, 20.0, f32::INFINITY].map(tanh), [0.0, -1.0, 1.0, 1.0]);
        assert!(tanh(f32::NAN).is_nan());
    }
}
