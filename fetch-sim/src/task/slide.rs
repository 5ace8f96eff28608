//! FetchSlide: hit a puck so that it slides to a point out of reach.

use super::spec::{GoalSpec, ObjectSpec, TaskSpec};
use crate::object::ObjectShape;

pub(super) const SLIDE: TaskSpec = TaskSpec {
    name: "Slide",
    scene_file: "slide.xml",
    #[cfg(feature = "mujoco")]
    scene_xml: include_str!("../../model/slide.xml"),
    base_position: [0.05, 0.48, 0.0],
    gripper_extra_height: -0.02,
    gripper_start: [0.996_119_83, 0.748_905_87, 0.412_666_18],
    block_gripper: true,
    object: Some(ObjectSpec {
        shape: ObjectShape::Cylinder { radius: 0.025, half_length: 0.02 },
        mass: 2.0,
        friction: 0.1,
        dropped_at: [1.7, 1.1, 0.41],
        settled_at: [1.7, 1.1, 0.414_018_943_520_539_75],
        range: 0.1,
        table: [[0.7, 1.95], [0.3, 1.2]],
        slides: true,
    }),
    goal: GoalSpec { range: 0.3, offset: [0.4, 0.0, 0.0], in_the_air: false },
};
