//! The Fetch robot on MuJoCo: a safe binding, the robot's model, and the operations of the tasks.
//!
//! [`Simulator`] is the trait through which an environment uses a simulated robot.
//! `MujocoSimulator` (feature `mujoco`, on by default) is the physics, with the same steps as
//! gymnasium-robotics 1.4.2; [`KinematicSimulator`] follows simple rules instead, for tests on
//! machines without MuJoCo.
//!
//! The binding below it consists of `Model`, shared by any number of simulations on any number of
//! threads, and `Data`, one simulation. MuJoCo's errors are returned as [`SimError`]; its warnings
//! go to `tracing` (target `mujoco`), never to a file.
//!
//! ```
//! # #[cfg(all(feature = "mujoco", not(fetch_sim_no_shim)))] {
//! use fetch_sim::{Control, FetchModel, MujocoSimulator, SimConfig, Simulator, Task};
//! use nalgebra::Vector3;
//!
//! let model = FetchModel::load(&SimConfig::new(Task::Push))?;
//! let mut simulator = MujocoSimulator::from_model(model.clone())?; // any number of them
//! simulator.reset(Some([1.30, 0.60]))?;
//! let before = simulator.gripper().position;
//! simulator.step(&Control { displacement: Vector3::new(0.05, 0.0, 0.0), fingers: 0.0 })?;
//! assert!(simulator.gripper().position.x > before.x + 0.02);
//! # }
//! # Ok::<(), fetch_sim::SimError>(())
//! ```
//!
//! # Which type do I need?
//! | to | use |
//! |---|---|
//! | simulate the robot of a task | `MujocoSimulator`, or [`KinematicSimulator`] without MuJoCo |
//! | change its settings | [`SimConfig`] |
//! | add to its model, or change its object | [`Extension`] |
//! | edit its model, or bring your own scene | `builtin_files`, [`ModelFiles`], [`ModelSource`] |
//! | show and place further objects | `MujocoSimulator::object_state`, `place_object` |
//! | change its physics between episodes | [`Simulator::reset_varied`] with [`Physics`] |
//! | step the robot | [`Simulator::step`] with a [`Control`] |
//! | simulate a model of your own | `Model`, then `Data` |
//! | draw a simulation | `Renderer` |
//! | write another simulator | [`Simulator`] |
//!
//! # A model of your own
//! An [`Extension`] adds bodies, geoms, sites and other sections of MJCF to the built-in model, and
//! changes the object's form, size, mass and friction. The result is loaded, shared, restored and
//! drawn like the built-in model. Here are a second block, and a wall that is placed again after
//! each reset:
//! ```
//! # #[cfg(all(feature = "mujoco", not(fetch_sim_no_shim)))] {
//! use fetch_sim::{Extension, ModelSource, MujocoSimulator, SimConfig, Simulator, Task};
//! use nalgebra::{UnitQuaternion, Vector3};
//!
//! let extension = Extension::default().with_object_mass(0.5).with_xml(
//!     r#"<worldbody>
//!          <body name="block" pos="1.2 0.9 0.425">
//!            <freejoint/>
//!            <geom type="box" size="0.025 0.025 0.025" mass="2" material="blue"/>
//!          </body>
//!          <body name="wall" mocap="true">
//!            <geom type="box" size="0.01 0.15 0.05"/>
//!          </body>
//!        </worldbody>"#,
//! );
//! let config = SimConfig::new(Task::Push).with_model(ModelSource::Extended(extension));
//! let mut simulator = MujocoSimulator::new(&config)?;
//! simulator.reset(Some([1.30, 0.60]))?;
//! let level = UnitQuaternion::identity();
//! simulator.place_object("block", Vector3::new(1.40, 0.60, 0.425), level)?;
//! simulator.place_object("wall", Vector3::new(1.35, 0.75, 0.45), level)?;
//! assert_eq!(simulator.object_state("block")?.position.x, 1.40);
//! # }
//! # Ok::<(), fetch_sim::SimError>(())
//! ```
//! What an extension cannot change, such as the table or the robot, is in the files that
//! `builtin_files` returns: edit them and simulate them as [`ModelSource::Files`], or bring your
//! own scene. [`ModelSource`] lists the names that it needs. If a simulation on MuJoCo 2 runs out
//! of room for contacts ([`SimError::BufferFull`]), add `<size njmax="1000" nconmax="300"/>`.
//!
//! # Features
//! | feature | adds | needs |
//! |---|---|---|
//! | `mujoco` (default) | the physics | MuJoCo 2.2 or later, and a C compiler |
//! | `render` (default) | pictures, depth, segmentation | OpenGL (EGL or OSMesa), at run time |
//! | `bundled` | nothing: leaves the build's path of MuJoCo out of the program | `use_library` |
//! | `download` | downloads of MuJoCo and of the reference's model | Python 3 with pip |
//!
//! # Speed
//! A `MujocoSimulator` skips collision tests that would find nothing (`ContactFilter`), unless
//! [`SimConfig::with_contact_filter`] turns that off; results are the same to the last bit. A new
//! `Data` has no such filter: its `step` is MuJoCo's bare loop of `mj_step`.
//!
//! # Threads
//! Any thread with a stack of 256 KiB can make and step simulations of the built-in model: MuJoCo
//! takes up to 96 KiB of it, and ends the process if there is less. Threads of the standard library
//! have 2 MiB unless they ask for less. Compiling your own model may need a larger stack.
//!
//! A process may fork at any time. The fork waits while another thread loads MuJoCo or compiles a
//! model, and the child can do both.
//!
//! # Finding MuJoCo
//! A build and a program take the MuJoCo that `MUJOCO_DIR` names, or the one that `fetch-env mujoco`
//! has remembered, or the system's: [`finding_mujoco`] has all places, and what is refused.
#![cfg_attr(docsrs, feature(doc_cfg))]

#[macro_use]
mod debug;
#[macro_use]
mod factors;
#[macro_use]
mod settings;

mod assets;
mod bounds;
mod cache;
mod config;
#[cfg(feature = "download")]
pub mod download;
mod error;
mod extension;
#[doc = include_str!("../FINDING_MUJOCO.md")]
pub mod finding_mujoco {}
mod kinematic;
mod looks;
mod memory;
mod model_files;
#[cfg(feature = "mujoco")]
mod mujoco;
mod object;
mod physics;
mod privileges;
mod simulator;
mod task;

pub use assets::ModelSource;
pub use bounds::{LARGEST_NUMBER, Substeps};
pub use cache::{Remembered, UnusableChoice, cache_folder, reference_folder, remembered_mujoco};
pub use config::SimConfig;
pub use error::{SimError, TriedLibrary};
pub use extension::Extension;
pub use kinematic::KinematicSimulator;
pub use looks::{LookFactor, Looks};
pub use memory::check_memory;
pub use model_files::ModelFiles;
#[cfg(feature = "mujoco")]
pub use mujoco::*;
pub use object::ObjectShape;
pub use physics::{Physics, PhysicsFactor};
pub use simulator::{Control, GripperState, ObjectState, Settled, Simulator};
pub use task::{GoalSpec, ObjectSpec, Task, TaskSpec};

/// The README's example, run as a test.
#[cfg(all(doctest, feature = "mujoco"))]
#[doc = include_str!("../README.md")]
struct Readme;
