//! FetchReach: move the gripper to a point in the air.

use super::spec::{GoalSpec, TaskSpec};

pub(super) const REACH: TaskSpec = TaskSpec {
    name: "Reach",
    scene_file: "reach.xml",
    #[cfg(feature = "mujoco")]
    scene_xml: include_str!("../../model/reach.xml"),
    base_position: [0.4049, 0.48, 0.0],
    gripper_extra_height: 0.2,
    gripper_start: [1.341_855_02, 0.749_100_51, 0.534_706_95],
    block_gripper: true,
    object: None,
    goal: GoalSpec { range: 0.15, offset: [0.0; 3], in_the_air: false },
};
