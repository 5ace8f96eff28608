//! FetchPickAndPlace: lift a cube to a point on the table or in the air.

use super::spec::{GoalSpec, ObjectSpec, TaskSpec};

pub(super) const PICK_AND_PLACE: TaskSpec = TaskSpec {
    name: "PickAndPlace",
    scene_file: "pick_and_place.xml",
    #[cfg(feature = "mujoco")]
    scene_xml: include_str!("../../model/pick_and_place.xml"),
    base_position: [0.405, 0.48, 0.0],
    gripper_extra_height: 0.2,
    gripper_start: [1.341_955_02, 0.749_100_5, 0.534_706_95],
    block_gripper: false,
    object: Some(ObjectSpec::CUBE),
    goal: GoalSpec { range: 0.15, offset: [0.0; 3], in_the_air: true },
};
