//! Actions of the Fetch environments.

use fetch_sim::Control;
use nalgebra::Vector3;

use crate::gym::env::action_space::check_numbers;
use crate::gym::error::EnvError;
use crate::gym::spaces::box_space::Element;

/// Number of elements of an action: dx, dy, dz, fingers.
pub(super) const ACTION_LEN: usize = 4;

/// The precision in which an action is clipped and scaled.
pub(super) trait Precision: Element + Into<f64> {
    /// Clips an element to [-1, 1].
    fn clipped(self) -> f64;

    /// Returns the displacement along an axis that an element commands, in meters: at most 5 cm.
    fn displacement(self) -> f64;
}

macro_rules! precisions {
    ($($float:ty),*) => {$(
        impl Precision for $float {
            fn clipped(self) -> f64 {
                self.clamp(-1.0, 1.0).into()
            }

            fn displacement(self) -> f64 {
                (self.clamp(-1.0, 1.0) * 0.05).into()
            }
        }
    )*};
}

precisions!(f32, f64);

/// Returns the elements of an action, if they are finite and as many as it takes.
pub(super) fn checked<P: Precision>(action: &[P]) -> Result<[P; ACTION_LEN], EnvError> {
    check_numbers(ACTION_LEN, action)?;
    let actual = action.len();
    action.try_into().map_err(|_| EnvError::ActionLength { expected: ACTION_LEN, actual })
}

/// Turns an action into the command of a control step.
///
/// Source: `_set_action` of gymnasium-robotics 1.4.2, which clips and scales in the precision of
/// the action and widens the result.
pub(super) fn control<P: Precision>([dx, dy, dz, fingers]: [P; ACTION_LEN]) -> Control {
    let displacement = Vector3::new(dx.displacement(), dy.displacement(), dz.displacement());
    Control { displacement, fingers: fingers.clipped() }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn an_action_is_clipped_and_scaled_in_its_own_precision(
            action in prop::array::uniform4(-3.0..3.0_f64),
        ) {
            let double = control(action);
            prop_assert_eq!(double.displacement.x, action[0].clamp(-1.0, 1.0) * 0.05);
            prop_assert_eq!(double.fingers, action[3].clamp(-1.0, 1.0));
            let single = action.map(|element| element as f32);
            let of_single = control(single);
            prop_assert_eq!(of_single.displacement.z, f64::from(single[2].clamp(-1.0, 1.0) * 0.05));
            prop_assert!((of_single.displacement - double.displacement).norm() < 1e-7);
        }
    }

    #[test]
    fn what_is_no_action_is_refused() {
        assert!(matches!(checked(&[0.0_f64; 3]), Err(EnvError::ActionLength { actual: 3, .. })));
        let refused = checked(&[0.0, 0.0, f64::NAN, 0.0]);
        assert!(matches!(refused, Err(EnvError::ActionNotFinite { index: 2, .. })));
    }
}
