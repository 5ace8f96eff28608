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
    object: Some(ObjectSpec {
        dropped_at: [1.25, 0.53, 0.4],
        settled_at: [1.25, 0.53, 0.424_699_749_459_536],
        range: 0.15,
        table: [[1.05, 1.55], [0.4, 1.1]],
        slides: false,
    }),
    goal: GoalSpec { range: 0.15, offset: [0.0; 3], in_the_air: false },
};
