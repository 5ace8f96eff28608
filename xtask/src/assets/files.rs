//! What the reference model is made of.

/// The files of Fetch in the wheel of gymnasium-robotics 1.4.2, below
/// `gymnasium_robotics/envs/assets`, with their SHA-256.
pub const FILES: [(&str, &str); 25] = [
    (
        "fetch/pick_and_place.xml",
        "019af84a6ee8e0ce56cd505f74e89115f6d23329d672b81eabd5bc015d535741",
    ),
    ("fetch/push.xml", "3f31bb93c573448bbc1a56a6551d43483f1fda147ebfdc025a69444275374214"),
    ("fetch/reach.xml", "d9f61905b0a706a9c210d92e11ca862056387534211bbea503f2371c5ad4bacd"),
    ("fetch/robot.xml", "f5fd3395c3d9efea0293f80c5d214355826510c9472b5eb5ca570761255da167"),
    ("fetch/shared.xml", "23ff1c601587a022c46e1a91cf2a10579c5b5f124e1e40afe23b4a76bf560329"),
    ("fetch/slide.xml", "513e606a6011236f5b6d04e90248951861bc7279e028604345fcb803e31a2987"),
    (
        "stls/fetch/base_link_collision.stl",
        "ddbbecaa94eebb923a153935b9ff02893ca159361ce4fb40363fe64ee6733b81",
    ),
    (
        "stls/fetch/bellows_link_collision.stl",
        "23b1ad0022edb12a65859bedf65dd6d018ee3769c1e48665c8ba2868c845306e",
    ),
    (
        "stls/fetch/elbow_flex_link_collision.stl",
        "fa200b07d6ffe096eb7823b2c2154cc8ce8e22ea5516f557719b9fb308283cb1",
    ),
    (
        "stls/fetch/estop_link.stl",
        "08ee8f343d047983477a5c57292ec6b4a4d317e9a999c8fbfd45b3249c8226fe",
    ),
    (
        "stls/fetch/forearm_roll_link_collision.stl",
        "a74b8d891845f56c58cdc9c4fb115b5ad1a89893cf9d5902310ea5bd7c70c81e",
    ),
    (
        "stls/fetch/gripper_link.stl",
        "d292a962df7d90eb13919ae8dd269e5ca55f2f54e2f6fa035c562684ff7ec26f",
    ),
    (
        "stls/fetch/head_pan_link_collision.stl",
        "36362238ca8c68d5aec127130014aa5c7b0ae5613b52ebd82603f6d9b03cf426",
    ),
    (
        "stls/fetch/head_tilt_link_collision.stl",
        "3444f186e3faa628654ba7c9ee096d422c34d07948fd5f502918ac4781238919",
    ),
    (
        "stls/fetch/l_wheel_link_collision.stl",
        "0be83a03318e7f2d51b59c2b13e56a5ecdfeaa2ba465bbd841f3605334be6a63",
    ),
    (
        "stls/fetch/laser_link.stl",
        "285e57045df959a58c14d0b26c1a24203bd213acd17554f5b07bc526dfbc0747",
    ),
    (
        "stls/fetch/r_wheel_link_collision.stl",
        "1280da184382df0ab072c91024046fc82c70d4f46c8d6697245d328af97aeeac",
    ),
    (
        "stls/fetch/shoulder_lift_link_collision.stl",
        "af0703cad45527a1e7e5c76e15a43a81600b8482e479e1ecceedff3624b381af",
    ),
    (
        "stls/fetch/shoulder_pan_link_collision.stl",
        "7d6e74913589c3b7ee113c6b55170a40b3cc7d4095c7c1c520464655e6e2d301",
    ),
    (
        "stls/fetch/torso_fixed_link.stl",
        "ee88311cd5ae20727c4ea7af579edea4da832b54a86b77d6804e4be30c638158",
    ),
    (
        "stls/fetch/torso_lift_link_collision.stl",
        "4f24652be8a346b040ee199d3586af874ca0359460d91b86d893ff2a85afdfde",
    ),
    (
        "stls/fetch/upperarm_roll_link_collision.stl",
        "b52550449cfa148390cbbcb3879ff3ee67a484e98bbd2ad91046c09d49dae9d1",
    ),
    (
        "stls/fetch/wrist_flex_link_collision.stl",
        "435f181dea365137f63e74f718911b7dfd780af6fc92ce5c74908e7d0790413b",
    ),
    (
        "stls/fetch/wrist_roll_link_collision.stl",
        "942ca8736eecefd12c6d5397292c5725546b70c0826d9daf67b68d69255011d5",
    ),
    ("textures/block.png", "d39ffb85a87d00c346764191e38ecac3135f2d6f690f64a8ee5da4783ef18e76"),
];
