//! Physics that differ from the model's give the bits of a model that is compiled with them.
#![cfg(all(feature = "mujoco", not(fetch_sim_no_shim)))]

use std::sync::{Arc, OnceLock};

use fetch_sim::{
    Control, Extension, FetchModel, ModelFiles, ModelSource, MujocoSimulator, ObjectShape, Physics,
    PhysicsFactor, SimConfig, SimError, Simulator, Task, builtin_files,
};
use nalgebra::Vector3;
use proptest::prelude::*;
use testing::Result;

/// The tasks with an object.
const TASKS: [Task; 3] = [Task::Push, Task::Slide, Task::PickAndPlace];

fn model(task: Task) -> Arc<FetchModel> {
    static MODELS: [OnceLock<Arc<FetchModel>>; 4] = [const { OnceLock::new() }; 4];
    let load = || FetchModel::load(&SimConfig::new(task)).expect("MuJoCo");
    Arc::clone(MODELS[task as usize].get_or_init(load))
}

fn simulator(task: Task) -> Result<MujocoSimulator, SimError> {
    MujocoSimulator::from_model(model(task))
}

/// Returns whether a factor applies to a task.
fn applies(task: Task, factor: PhysicsFactor) -> bool {
    factor != PhysicsFactor::FingerStrength || task == Task::PickAndPlace
}

/// Any few numbers of a task's physics.
fn physics(task: Task) -> impl Strategy<Value = Physics> {
    let factors: Vec<_> =
        PhysicsFactor::ALL.iter().copied().filter(|&factor| applies(task, factor)).collect();
    let factors = proptest::sample::subsequence(factors.clone(), 0..=factors.len());
    let scales = proptest::collection::vec(0.5..2.0, PhysicsFactor::ALL.len());
    (factors, scales).prop_map(|(factors, scales)| {
        factors.into_iter().zip(scales).fold(Physics::default(), |physics, (factor, scale)| {
            let value = match factor {
                PhysicsFactor::ObjectSize => 0.8 + 0.2 * scale,
                PhysicsFactor::ObjectSpinFriction | PhysicsFactor::ObjectDamping => 0.02 * scale,
                PhysicsFactor::Gravity => 9.0 * scale,
                _ => scale,
            };
            physics.with(factor, value).expect("within the bounds")
        })
    })
}

/// Replaces a text that a file must have.
fn edit(files: ModelFiles, name: &str, from: &str, to: &str) -> ModelFiles {
    let text = files.get(name).expect("a file");
    assert!(text.contains(from), "{name} has no {from}");
    let text = text.replace(from, to);
    files.with_file(name, text)
}

/// Returns the built-in model with these numbers in its XML.
fn compiled(task: Task, physics: &Physics) -> Result<MujocoSimulator> {
    use PhysicsFactor as Factor;
    let spec = task.spec();
    let (scene, object) = (spec.scene_file, spec.object.expect("an object"));
    let scale = |factor| physics.get(factor).unwrap_or(1.0);
    let mut files = builtin_files(task);

    let (sizes, kind) = match object.shape {
        ObjectShape::Box { half_size } => (half_size.to_vec(), "box"),
        ObjectShape::Cylinder { radius, half_length } => (vec![radius, half_length], "cylinder"),
        other => panic!("{other:?}"),
    };
    let size = scale(Factor::ObjectSize);
    let sizes: Vec<_> = sizes.iter().map(|half| (half * size).to_string()).collect();
    let mass = physics.get(Factor::ObjectMass).unwrap_or(object.mass);
    let all = scale(Factor::Friction);
    let friction = physics.get(Factor::ObjectFriction).unwrap_or(object.friction) * all;
    let spin = physics.get(Factor::ObjectSpinFriction).unwrap_or(0.005);
    files = files.with_file(
        "object.xml",
        format!(
            r#"<mujocoinclude>
                 <geom name="object0" type="{kind}" size="{}" mass="{mass}"
                       friction="{friction} {spin} 0.0001"/>
                 <site name="object0" size="0.01"/>
               </mujocoinclude>"#,
            sizes.join(" ")
        ),
    );
    let damping = physics.get(Factor::ObjectDamping).unwrap_or(0.01);
    let damping = format!(r#"type="free" damping="{damping}""#);
    files = edit(files, scene, r#"type="free" damping="0.01""#, &damping);
    let table = physics.get(Factor::TableFriction).unwrap_or(object.friction) * all;
    let table = format!(r#"mass="2000" friction="{table} 0.005 0.0001""#);
    let was = match task {
        Task::Slide => r#"mass="2000" friction="0.1 0.005 0.0001""#,
        _ => r#"mass="2000""#,
    };
    files = edit(files, scene, was, &table);
    let finger = physics.get(Factor::FingerFriction).unwrap_or(1.0) * all;
    let finger = format!(r#"friction="{finger} 0.05 0.01""#);
    files = edit(files, "settings.xml", r#"friction="1 0.05 0.01""#, &finger);
    let time_constant = 0.02 / scale(Factor::ArmStiffness).sqrt();
    let solref = format!(r#"solref="{time_constant} 1" solimp="0.9 0.95 0.001""#);
    files = edit(files, "settings.xml", r#"solref="0.02 1" solimp="0.9 0.95 0.001""#, &solref);
    let gravity = physics.get(Factor::Gravity).unwrap_or(9.81);
    let option = format!(r#"<option timestep="0.002" gravity="0 0 -{gravity}"/>"#);
    files = edit(files, "settings.xml", r#"<option timestep="0.002"/>"#, &option);
    let arm = scale(Factor::ArmDamping);
    let forearm = format!(r#"damping="{}" stiffness"#, 3.5247 * arm);
    files = edit(files, "robot.xml", r#"damping="3.5247" stiffness"#, &forearm);
    for joint in ["shoulder_pan", "shoulder_lift", "upperarm_roll", "elbow_flex"]
        .into_iter()
        .chain(["wrist_flex", "wrist_roll"])
    {
        let name = format!(r#"<joint name="robot0:{joint}_joint""#);
        files = edit(files, "robot.xml", &name, &format!(r#"{name} damping="{}""#, 50.0 * arm));
    }
    if task == Task::PickAndPlace {
        let strength = 30000.0 * scale(Factor::FingerStrength);
        files = edit(files, scene, r#"kp="30000""#, &format!(r#"kp="{strength}""#));
    }
    let config = SimConfig::new(task).with_model(ModelSource::Files(files));
    Ok(MujocoSimulator::new(&config)?)
}

/// Takes a simulator to the start of another one, as a reset does.
fn start_like(simulator: &mut MujocoSimulator, other: &MujocoSimulator) -> Result<()> {
    let mut data = simulator.data_mut();
    data.reset()?;
    data.set_time(other.data().time())?;
    data.qpos_mut().copy_from_slice(other.data().qpos());
    data.qvel_mut().copy_from_slice(other.data().qvel());
    Ok(data.forward()?)
}

/// Goes to the object, pushes and grips it.
fn control(simulator: &MujocoSimulator, step: u32) -> Control {
    let object = simulator.object().expect("an object").position;
    let above = if step < 12 { 0.06 } else { 0.0 };
    let to = object + Vector3::new(0.0, 0.0, above) - simulator.gripper().position;
    let aside = Vector3::new(0.05, 0.02, if step < 45 { 0.0 } else { 0.05 });
    let displacement = if step < 25 { to } else { aside };
    let fingers = if step < 18 { 0.05 } else { -0.05 };
    Control { displacement: displacement.map(|axis| axis.clamp(-0.05, 0.05)), fingers }
}

fn bits(simulator: &MujocoSimulator) -> Vec<u64> {
    let data = simulator.data();
    data.qpos().iter().chain(data.qvel()).map(|number| number.to_bits()).collect()
}

fn check_against_compiled(task: Task, before: &Physics, physics: &Physics) -> Result<()> {
    let mut varied = simulator(task)?;
    varied.data_mut().check_rejections(true);
    // What was simulated before leaves no trace.
    varied.reset_varied(None, before)?;
    varied.step(&control(&varied, 0))?;
    varied.reset_varied(Some([1.3, 0.7]), physics)?;
    let mut unfiltered = MujocoSimulator::from_model(model(task))?;
    unfiltered.data_mut().set_contact_filter(false)?;
    unfiltered.reset_varied(Some([1.3, 0.7]), physics)?;
    let mut compiled = compiled(task, physics)?;
    start_like(&mut compiled, &varied)?;
    for step in 0..70 {
        let control = control(&varied, step);
        varied.step(&control)?;
        compiled.step(&control)?;
        unfiltered.step(&control)?;
        assert_eq!(bits(&varied), bits(&compiled), "step {step} of {task} with {physics:?}");
        assert_eq!(bits(&varied), bits(&unfiltered), "step {step} of {task} without a filter");
    }
    let counts = varied.data().contact_filter().expect("a filter").counts();
    assert!(counts.rejected > 0 && counts.refuted == 0, "{counts:?}");
    Ok(())
}

#[test]
fn each_number_has_the_bits_of_a_compiled_model() -> Result<()> {
    for task in TASKS {
        for &factor in PhysicsFactor::ALL.iter().filter(|&&factor| applies(task, factor)) {
            let value = match factor {
                PhysicsFactor::ObjectSize => 1.15,
                PhysicsFactor::Gravity => 6.0,
                _ => 0.7,
            };
            let physics = Physics::default().with(factor, value)?;
            check_against_compiled(task, &Physics::default(), &physics)?;
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn several_numbers_have_the_bits_of_a_compiled_model(
        (task, before, physics) in proptest::sample::select(&TASKS[..])
            .prop_flat_map(|task| (Just(task), physics(task), physics(task)))
    ) {
        check_against_compiled(task, &before, &physics).map_err(|error| {
            TestCaseError::fail(error.to_string())
        })?;
    }

    #[test]
    fn a_snapshot_restores_the_physics_also_elsewhere(
        (task, physics, other) in proptest::sample::select(&TASKS[..])
            .prop_flat_map(|task| (Just(task), physics(task), physics(task)))
    ) {
        let run = || -> Result<()> {
            let mut one = simulator(task)?;
            one.reset_varied(Some([1.3, 0.7]), &physics)?;
            for step in 0..20 {
                one.step(&control(&one, step))?;
            }
            let snapshot = serde_json::from_str(&serde_json::to_string(&one.snapshot())?)?;
            let mut another = simulator(task)?;
            another.reset_varied(None, &other)?;
            another.restore(&snapshot)?;
            assert_eq!(another.physics(), physics);
            for step in 20..50 {
                let control = control(&one, step);
                one.step(&control)?;
                another.step(&control)?;
                assert_eq!(one.snapshot(), another.snapshot());
            }
            // A plain reset has the model's own physics again.
            let mut plain = simulator(task)?;
            for simulator in [&mut another, &mut plain] {
                simulator.reset(Some([1.3, 0.7]))?;
                simulator.step(&control(simulator, 0))?;
            }
            assert_eq!(another.snapshot(), plain.snapshot());
            Ok(())
        };
        run().map_err(|error| TestCaseError::fail(error.to_string()))?;
    }
}

#[test]
fn what_cannot_vary_is_refused() -> Result<()> {
    let mass = Physics::default().with(PhysicsFactor::ObjectMass, 1.0)?;
    let mut reach = simulator(Task::Reach)?;
    let before = reach.snapshot();
    let error = reach.reset_varied(None, &mass).unwrap_err().to_string();
    assert_eq!(
        error,
        "object_mass cannot vary here, because the scene has no object: leave it out"
    );
    assert_eq!(reach.snapshot(), before);

    let strength = Physics::default().with(PhysicsFactor::FingerStrength, 2.0)?;
    let error = simulator(Task::Push)?.reset_varied(None, &strength).unwrap_err();
    assert!(matches!(error, SimError::CannotVary { .. }), "{error}");

    // A second geom: the body's inertia is not that of one form.
    let files = builtin_files(Task::Push);
    let object = files.get("object.xml").expect("the object");
    let two = object.replace("<site", r#"<geom type="sphere" size="0.01" mass="1"/><site"#);
    let files = files.with_file("object.xml", two);
    let config = SimConfig::new(Task::Push).with_model(ModelSource::Files(files));
    let mut two = MujocoSimulator::new(&config)?;
    assert!(matches!(two.reset_varied(None, &mass), Err(SimError::CannotVary { .. })));
    two.reset_varied(None, &Physics::default().with(PhysicsFactor::ObjectFriction, 2.0)?)?;

    // A snapshot that was made by hand.
    let mut forged = serde_json::to_value(reach.snapshot())?;
    forged["physics"] = serde_json::json!({ "object_mass": 1.0 });
    let error = reach.restore(&serde_json::from_value(forged.clone())?).unwrap_err();
    assert!(matches!(error, SimError::ForeignSnapshot { .. }), "{error}");
    forged["physics"] = serde_json::json!({ "gravity": 1e9 });
    assert!(serde_json::from_value::<fetch_sim::MujocoSnapshot>(forged).is_err());
    Ok(())
}

#[test]
fn an_own_coefficient_of_object_and_table_varies() -> Result<()> {
    let extension = Extension::default().with_object_friction(0.3);
    let slippery = SimConfig::new(Task::Push).with_model(ModelSource::Extended(extension));
    let extension = Extension::default().with_object_friction(0.6);
    let rough = SimConfig::new(Task::Push).with_model(ModelSource::Extended(extension));
    let (mut slippery, mut rough) =
        (MujocoSimulator::new(&slippery)?, MujocoSimulator::new(&rough)?);
    slippery.reset_varied(
        Some([1.3, 0.7]),
        &Physics::default().with(PhysicsFactor::ObjectFriction, 0.6)?,
    )?;
    start_like(&mut rough, &slippery)?;
    for step in 0..50 {
        let control = control(&slippery, step);
        slippery.step(&control)?;
        rough.step(&control)?;
        assert_eq!(bits(&slippery), bits(&rough));
    }
    Ok(())
}
