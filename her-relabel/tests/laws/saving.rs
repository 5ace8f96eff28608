//! A loaded buffer equals the saved one, and saving leaves a whole file.

use std::fs;
use std::io::{self, Read, Write};
use std::num::NonZeroUsize;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, SystemTime};

use crate::common::{DIMS, Result, add, begin, buffer, step};
use her_relabel::{
    BufferConfig, EpisodeData, GoalNoise, GoalPart, GoalStrategy, HerBuffer, LoadError,
    MotionlessEpisodes, NStep, NewPriority, Priorities, PriorityUnit, Sampler, StepData,
    UnitInterval,
};
use serde::de::DeserializeOwned;

pub(crate) fn saved(buffer: &HerBuffer<f64>) -> Vec<u8> {
    let mut bytes = Vec::new();
    buffer.write_to(&mut bytes).unwrap();
    bytes
}

pub(crate) fn load(bytes: &[u8]) -> Result<HerBuffer<f64>, LoadError> {
    HerBuffer::read_from(bytes)
}

/// A buffer with everything: a ring that has wrapped, a field, priorities, and an unfinished
/// episode.
pub(crate) fn small() -> HerBuffer<f64> {
    let config = BufferConfig::new(8, DIMS).with_field("value", 1).with_priorities(
        Priorities::new(PriorityUnit::Episode).with_new_priority(NewPriority::Given(0.5)),
    );
    let mut buffer = HerBuffer::new(config).unwrap();
    for episode in 0..4_u8 {
        buffer
            .add_episode(&EpisodeData {
                observation: &[f64::from(episode); 8],
                achieved_goal: &[0.25; 12],
                desired_goal: &[0.5; 3],
                action: &[0.0; 3],
                reward: &[-1.0; 3],
                terminated: false,
                truncated: true,
                fields: &[("value", &[1.0, 2.0, 3.0])],
            })
            .unwrap();
    }
    let (_, newest) = buffer.transition_ids().unwrap();
    buffer.set_priorities(&[newest], &[2.0]).unwrap();
    begin(&mut buffer, 0, 7).unwrap();
    let fields: &[(&str, &[f64])] = &[("value", &[4.0])];
    buffer.add_step(0, &StepData { fields, ..plain_step() }).unwrap();
    buffer
}

pub(crate) fn plain_step() -> StepData<'static, f64> {
    StepData {
        action: &[0.0],
        reward: -1.0,
        next_observation: &[7.0, 1.0],
        next_achieved_goal: &[0.0; 3],
        terminated: false,
        truncated: false,
        fields: &[],
    }
}

/// A similar buffer without a field and priorities, whose numbers identify their place.
fn plain() -> HerBuffer<f64> {
    let mut buffer = buffer(8);
    for episode in 0..4 {
        add(&mut buffer, episode, 3, (false, true));
    }
    begin(&mut buffer, 0, 7).unwrap();
    step(&mut buffer, 0, 7, 0, (false, false)).unwrap();
    buffer
}

#[test]
fn settings_keep_their_serialized_names() -> Result {
    let config = BufferConfig::new(400, DIMS)
        .with_num_envs(2)
        .with_field("value", 1)
        .with_priorities(Priorities::new(PriorityUnit::Episode));
    let text = concat!(
        r#"{"capacity":400,"dims":{"observation":2,"goal":3,"action":1},"num_envs":2,"#,
        r#""fields":[{"name":"value","len":1}],"#,
        r#""priorities":{"unit":"episode","new_priority":"highest"},"motionless_episodes":null}"#
    );
    assert_eq!(serde_json::to_string(&config)?, text);
    assert_eq!(serde_json::from_str::<BufferConfig>(text)?, config);

    let sampler = Sampler::new(9, GoalStrategy::Future, UnitInterval::from_k(1))
        .with_n_step(NStep::new(NonZeroUsize::MIN, UnitInterval::ONE))
        .with_priorities(UnitInterval::ZERO)
        .with_goal_noise(GoalNoise::new(0.04, UnitInterval::ONE));
    let text = concat!(
        r#"{"batch_size":9,"goals":[{"strategy":"future","weight":1.0}],"ratio":0.5,"#,
        r#""termination":"stored","success":false,"n_step":{"steps":1,"gamma":1.0},"#,
        r#""priorities":0.0,"parallel":false,"joined_goal":null,"keep_already_achieved":1.0,"#,
        r#""recomputed_rewards":false,"#,
        r#""mirrored":0.0,"goal_noise":{"radius":0.04,"share":1.0}}"#
    );
    assert_eq!(serde_json::to_string(&sampler)?, text);
    assert_eq!(serde_json::from_str::<Sampler>(text)?, sampler);
    assert!(serde_json::from_str::<Sampler>(&text.replace("0.5", "1.5")).is_err());
    Ok(())
}

#[test]
fn settings_with_a_wrong_name_are_refused() {
    fn refuses<S: DeserializeOwned>(text: &str, name: &str) {
        assert!(serde_json::from_str::<S>(text).is_ok(), "{text}");
        let text = format!("{{\"{name}\":0,{}", &text[1..]);
        assert!(serde_json::from_str::<S>(&text).is_err(), "{text}");
    }
    refuses::<NStep>(r#"{"steps":2,"gamma":0.5}"#, "gama");
    refuses::<GoalNoise>(r#"{"radius":0.5,"share":0.5}"#, "part");
    refuses::<GoalPart>(r#"{"strategy":"future","weight":1}"#, "wight");
    refuses::<Priorities>(r#"{"unit":"episode"}"#, "new");
    refuses::<MotionlessEpisodes>(r#"{"max_distance":0.01,"kept":0.1}"#, "keep");
    let geometric = r#"{"geometric":{"gamma":0.5,"steps":2}}"#;
    assert!(serde_json::from_str::<GoalStrategy>(geometric).is_err());
}

#[test]
fn saving_replaces_the_file_whole_or_not_at_all() -> Result {
    let directory = tempfile::tempdir()?;
    let path = directory.path().join("replay.her");
    small().save(&path)?;
    assert!(saved(&HerBuffer::load(&path)?) == saved(&small()));
    let mut later = small();
    later.end_episode(0)?;
    later.save(&path)?;
    assert!(saved(&HerBuffer::load(&path)?) == saved(&later));
    assert_eq!(fs::read_dir(directory.path())?.count(), 1, "nothing is left over");
    assert!(later.save(directory.path().join("missing").join("replay.her")).is_err());
    // A file cannot replace a directory: the last step fails, after everything was written.
    let taken = directory.path().join("taken");
    fs::create_dir(&taken)?;
    assert!(later.save(&taken).is_err());
    assert_eq!(fs::read_dir(directory.path())?.count(), 2);
    let missing = HerBuffer::<f64>::load(directory.path().join("none")).unwrap_err();
    assert!(matches!(missing, LoadError::Io(_)));
    Ok(())
}

#[test]
fn saving_touches_no_other_file() -> Result {
    let directory = tempfile::tempdir()?;
    let long_ago = SystemTime::now() - Duration::from_secs(1_000_000);
    let neighbors = [".replay.backup", ".replay.config", ".replay.2024Q1", ".replay.a1B2c3"];
    for name in neighbors {
        let mut file = fs::File::create(directory.path().join(name))?;
        file.write_all(name.as_bytes())?;
        file.set_modified(long_ago)?;
    }
    small().save(directory.path().join("replay"))?;
    for name in neighbors {
        assert_eq!(fs::read_to_string(directory.path().join(name))?, name);
    }
    assert_eq!(fs::read_dir(directory.path())?.count(), neighbors.len() + 1);
    Ok(())
}

/// A disk with room for a number of bytes.
struct Disk(usize);

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = bytes.len().min(self.0);
        self.0 -= count;
        Ok(count)
    }
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// The process that the next test starts and kills.
#[test]
#[ignore = "runs until it is killed"]
fn saves_forever() {
    let path = std::env::var_os("HER_RELABEL_SAVES_TO").unwrap();
    // It ends with the process that has started it, however that ends.
    let parent = thread::spawn(|| io::stdin().read_to_end(&mut Vec::new()));
    while !parent.is_finished() {
        small().save(&path).unwrap();
        plain().save(&path).unwrap();
    }
}

#[test]
fn a_crash_while_saving_leaves_a_whole_file() -> Result {
    let directory = tempfile::tempdir()?;
    let path = directory.path().join("replay.her");
    small().save(&path)?;
    for wait in 0..12 {
        let mut child = Command::new(std::env::current_exe()?)
            .args(["--exact", "saving::saves_forever", "--ignored"])
            .env("HER_RELABEL_SAVES_TO", &path)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .spawn()?;
        // It is at work once it has replaced the file.
        let before = fs::metadata(&path)?.modified()?;
        while fs::metadata(&path)?.modified()? == before {
            assert!(child.try_wait()?.is_none(), "it saves until it is killed");
        }
        thread::sleep(Duration::from_micros(wait * 300));
        child.kill()?;
        child.wait()?;
        let loaded = HerBuffer::load(&path)?;
        let expected = if loaded.config().priorities().is_some() { small() } else { plain() };
        assert!(saved(&loaded) == saved(&expected));
    }
    Ok(())
}

#[test]
fn a_full_disk_is_an_error() {
    let size = saved(&small()).len();
    assert!(small().write_to(Disk(size)).is_ok());
    for room in [0, 10, size / 2, size - 1] {
        assert!(small().write_to(Disk(room)).is_err());
    }
}
