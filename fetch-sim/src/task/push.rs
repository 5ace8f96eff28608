//! FetchPush: push a cube to a point on the table with closed fingers.

use super::spec::{GoalSpec, ObjectSpec, TaskSpec};

pub(super) const PUSH: TaskSpec = TaskSpec {
    name: "Push",
    scene_file: "push.xml",
    #[cfg(feature = "mujoco")]
    scene_xml: include_str!("../../model/push.xml"),
    base_position: [0.405, 0.48, 0.0],
    gripper_extra_height: 0.0,
    gripper_start: [1.348_205_77, 0.748_948_84, 0.413_618_29],
    block_gripper: true,
    object: Some(ObjectSpec::CUBE),
    goal: GoalSpec { range: 0.15, offset: [0.0; 3], in_the_air: false },
};
