//! Mutable access to the simulation inside a simulator.

use std::ops::Deref;

use nalgebra::{Quaternion, Vector3};

use crate::error::SimError;
use crate::mujoco::binding::data::Data;

/// The simulation of a [`MujocoSimulator`](crate::MujocoSimulator), mutably: a [`Data`] of which
/// everything can be changed except the model, so it cannot be exchanged for that of another
/// simulator:
/// ```compile_fail,E0596
/// # use fetch_sim::MujocoSimulator;
/// fn exchange(push: &mut MujocoSimulator, slide: &mut MujocoSimulator) {
///     std::mem::swap(&mut *push.data_mut(), &mut *slide.data_mut());
/// }
/// ```
#[derive(Debug)]
pub struct DataMut<'a>(pub(super) &'a mut Data);

impl Deref for DataMut<'_> {
    type Target = Data;

    fn deref(&self) -> &Data {
        self.0
    }
}

/// Declares the methods that change a simulation.
macro_rules! forward {
    ($($name:ident($($argument:ident: $kind:ty),*) $(-> $result:ty)?;)*) => {
        impl DataMut<'_> {$(
            #[doc = concat!("Calls [`Data::", stringify!($name), "`].")]
            pub fn $name(&mut self, $($argument: $kind),*) $(-> $result)? {
                self.0.$name($($argument),*)
            }
        )*}
    };
}

forward! {
    set_contact_filter(filter: bool) -> Result<(), SimError>;
    check_rejections(check: bool);
    reset() -> Result<(), SimError>;
    forward() -> Result<(), SimError>;
    step(count: u32) -> Result<(), SimError>;
    set_time(time: f64) -> Result<(), SimError>;
    qpos_mut() -> &mut [f64];
    qvel_mut() -> &mut [f64];
    ctrl_mut() -> &mut [f64];
    set_mocap_pose(
        mocap: usize,
        pos: Vector3<f64>,
        quat: Quaternion<f64>
    ) -> Result<(), SimError>;
}
