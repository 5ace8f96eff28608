//! Pages that play episodes back, without a browser.

mod plane;

use std::io::Cursor;

use base64::{Engine, prelude::BASE64_STANDARD};
use baselines::{
    Policy, PolicyError, RandomPolicy, ScriptedPolicy, TrainedPolicy,
    page::{Axis, Document, Ink, PageError, Playback, PlaybackEnv, Plot, Scene, episode_page},
};
use fetch_env::variation::Variation;
use fetch_env::wrappers::TimeAwareObservation;
use fetch_env::{
    Env, EnvError, EnvExt, EnvId, Extension, FetchConfig, FetchObservation, FetchTask, GoalEnv,
    GoalObservation, ModelSource, MujocoSimulator, NpRandom, Reset, Simulator, Space, Step, Task,
    make, make_kinematic,
};
use goal_reward::RewardKind;
use plane::{Plane, STEPS};
use serde_json::Value;

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

/// Fails unless every tag that is opened is closed, and nothing is loaded from elsewhere.
fn assert_well_formed(html: &str) {
    for outside in ["http://", "https://", "src=\"/", "<link", "@import", "url("] {
        assert!(!html.contains(outside), "{outside}");
    }
    for tag in ["html", "head", "style", "body", "script", "figure", "svg", "section", "p"] {
        let opened =
            html.matches(&format!("<{tag}>")).count() + html.matches(&format!("<{tag} ")).count();
        assert_eq!(opened, html.matches(&format!("</{tag}>")).count(), "{tag}");
    }
}

/// The episode that a page holds.
fn episode_in(html: &str) -> Result<Value> {
    let (_, rest) = html.split_once("<script type=\"application/json\">").ok_or("no episode")?;
    let (json, _) = rest.split_once("</script>").ok_or("no end")?;
    Ok(serde_json::from_str(json)?)
}

#[test]
fn a_page_holds_the_episode() -> Result {
    let id = EnvId { task: Task::Push, ..EnvId::ALL[0] };
    let html = episode_page(&mut make(id)?, &mut ScriptedPolicy::new(id.task), 3)?;
    assert_well_formed(&html);
    assert!(html.starts_with("<!doctype html>") && html.contains("<h1>FetchPush-v4, seed 3</h1>"));

    // The same episode, stepped here.
    let mut env = make(id)?;
    let start = env.reset(Some(3))?.observation;
    let (mut policy, mut observation) = (ScriptedPolicy::new(id.task), start.clone());
    let (mut rewards, mut action) = (Vec::new(), [0.0; 4]);
    loop {
        policy.act(&observation, &mut action);
        let step = env.step(&action)?;
        rewards.push(Value::from(step.reward));
        observation = step.observation;
        if step.truncated {
            break;
        }
    }
    let episode = episode_in(&html)?;
    assert_eq!(episode["rewards"], Value::from(rewards));
    assert_eq!(episode["distances"].as_array().ok_or("no list")?.len(), 51);
    let near = |a: &Value, b: f64| a.as_f64().is_some_and(|a| (a - b).abs() < 1e-5);
    let goal = start.desired_goal();
    assert!((0..3).all(|axis| near(&episode["goals"][0][axis], goal[axis])));
    // One body moves as the block does.
    let object = observation.object_position().ok_or("no object")?;
    let last_poses = episode["bodies"].as_array().ok_or("no list")?.iter().filter_map(|poses| {
        let poses = poses.as_array()?;
        (poses.len() == 51 * 7).then(|| &poses[50 * 7..])
    });
    let is_object = |pose: &[Value]| (0..3).all(|axis| near(&pose[axis], object[axis]));
    assert!(last_poses.into_iter().any(is_object));
    Ok(())
}

#[test]
fn pages_of_ones_own_are_put_together() -> Result {
    let mut seen = Vec::new();
    let mut env = make("FetchReach-v4")?;
    let mut policy = RandomPolicy::new(env.action_space(), 1);
    let playback = Playback::record(&mut env, &mut policy, 1, |step, _, _| {
        seen.push(step);
    })?;
    assert_eq!(seen, (1..=50).collect::<Vec<_>>());
    assert_eq!(playback.num_steps(), 50);
    assert!(playback.outcome().starts_with("50 steps, return -"), "{}", playback.outcome());

    let playback = playback.with_title("</script> & \"friends\"");
    let mut plot = Plot::new("a < b", Axis::new("x", 0.0, 1.0), Axis::around("y", [-1.0, 2.0]));
    plot.line(Ink::Blue, [(0.0, 0.0), (0.5, 7.0)]);
    plot.band(Ink::Orange, &[(0.0, -1.0, 0.0), (1.0, 0.0, 1.0)]);
    plot.bar(Ink::Teal, (0.2, 0.0), (0.4, 1.0));
    plot.area((0.0, 0.0), (1.0, 1.0));
    plot.dots(Ink::Red, [(0.1, 0.1)]);
    plot.dot(Ink::Text, (0.3, 0.3));
    plot.vertical(0.5);
    plot.legend(Ink::Blue, "line");
    let svg = plot.svg()?;
    // Every color is the page's.
    assert!(!svg.contains("\"#"), "{svg}");
    for color in ["text", "faint", "rule", "area", "blue", "orange", "red", "teal"] {
        assert!(svg.contains(&format!("\"var(--{color})\"")), "{color}: {svg}");
    }

    let mut page = Document::new("Two parts");
    page.push(&playback.html()?);
    page.section("plot", "A plot", &svg);
    assert_well_formed(&page.html());
    assert!(page.html().contains("<h2 id=\"plot\">A plot</h2>"));
    Ok(())
}

#[test]
fn bad_input_is_an_error() -> Result {
    for bad in [f64::NAN, f64::INFINITY] {
        let plot = Plot::new("plot", Axis::new("x", 0.0, bad), Axis::new("y", 0.0, 1.0));
        assert!(matches!(plot.with_equal_scale().svg(), Err(PageError::Plot { .. })), "{bad}");
    }
    assert!(matches!(
        Plot::new("empty", Axis::around("x", []), Axis::new("y", 0.0, 1.0)).svg(),
        Err(PageError::Plot { .. })
    ));
    for (low, high) in [(-1.7e308, 1.7e308), (-f64::MAX, f64::MAX), (1.0, 0.0)] {
        for [x, y] in [[(low, high), (0.0, 1.0)], [(0.0, 1.0), (low, high)]] {
            let plot = Plot::new("plot", Axis::new("x", x.0, x.1), Axis::new("y", y.0, y.1));
            assert!(matches!(plot.svg(), Err(PageError::Plot { .. })), "{low}, {high}");
        }
    }
    let thin = Plot::new("plot", Axis::new("x", 0.0, 1e-9), Axis::new("y", 0.0, 1.0));
    assert!(thin.svg().is_ok());
    assert!(matches!(thin.with_equal_scale().svg(), Err(PageError::Plot { .. })));
    // A single value still makes an axis, and points that are not numbers stay within it.
    let mut plot = Plot::new("one value", Axis::around("x", [1.0]), Axis::new("y", 2.0, 2.0));
    plot.line(Ink::Blue, [(f64::NAN, f64::INFINITY), (1.0, 2.0)]);
    assert!(!plot.svg()?.contains("NaN"));

    Ok(())
}

/// A block that the user has added is drawn, and moves with its body.
#[test]
fn an_extended_model_of_another_size_is_played_back() -> Result {
    let block = r#"<worldbody><body name="ball" pos="1.5 1 0.42"><freejoint/>
        <geom type="sphere" size="0.0123" mass="0.1"/></body></worldbody>"#;
    let model = ModelSource::Extended(Extension::default().with_xml(block));
    let variation = Variation::default().with("object_size", 1.5)?;
    let config = FetchConfig::new(Task::Push, RewardKind::Sparse).with_model(model);
    let mut env = make(config.with_variation(variation))?;
    let mut policy = RandomPolicy::new(env.action_space(), 0);
    let episode = episode_in(&episode_page(&mut env, &mut policy, 0)?)?;
    let shapes = episode["shapes"].as_array().ok_or("no shapes")?;
    let has = |size: f64| shapes.iter().any(|shape| shape["size"][0] == size);
    assert!(has(0.0123) && has(0.025 * 1.5) && !has(0.025), "{shapes:?}");
    Ok(())
}

/// The longest axes that floating point has, and the shortest: their ticks are found.
#[test]
fn axes_of_any_length_are_drawn() -> Result {
    for value in [0.0_f64, 5e-324, 1e-300, 1e-17, 1.0, 1e16, 1e300, 1.7e308, -1e300] {
        let next = value.next_up();
        for (low, high) in [(value, next), (value.min(0.0), value.max(0.0)), (value, value)] {
            let axes = (Axis::new("x", low, high), Axis::new("y", 0.0, 1.0));
            let svg = Plot::new("plot", axes.0, axes.1).svg()?;
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{low:e}, {high:e}: {svg}");
        }
    }
    Ok(())
}

/// Gives actions that the environment rejects.
struct Diverged;

impl Policy for Diverged {
    fn act(&mut self, _observation: &FetchObservation, action: &mut [f32]) {
        action.fill(f32::NAN);
    }
}

#[test]
fn a_failing_episode_is_an_error_with_its_seed() -> Result {
    let error = episode_page(&mut make("FetchReach-v4")?, &mut Diverged, 8).err();
    assert!(matches!(error, Some(PageError::Environment { seed: 8, .. })), "{error:?}");
    Ok(())
}

#[test]
fn a_policy_of_other_lengths_is_refused() -> Result {
    let mut policy = TrainedPolicy::shipped(Task::Push)?;
    let error = episode_page(&mut make("FetchReach-v4")?, &mut policy, 0).err();
    assert!(matches!(error, Some(PageError::Policy(PolicyError::Trained { .. }))), "{error:?}");
    Ok(())
}

/// Two positions as a goal: the gripper's, and one beside it.
#[derive(Clone, Debug)]
struct Two;

impl FetchTask<MujocoSimulator> for Two {
    type Memory = ();

    fn goal_len(&self) -> usize {
        6
    }

    fn begin_episode(
        &self,
        _config: &FetchConfig,
        _simulator: &mut MujocoSimulator,
        _random: &mut NpRandom,
        desired_goal: &mut [f64],
    ) -> Result<(), EnvError> {
        desired_goal.copy_from_slice(&[1.3, 0.7, 0.5, 1.4, 0.8, 0.6]);
        Ok(())
    }

    fn achieved_goal(
        &self,
        simulator: &MujocoSimulator,
        _: &(),
        achieved_goal: &mut [f64],
    ) -> Result<(), EnvError> {
        let gripper = simulator.gripper().position;
        achieved_goal.copy_from_slice(&[gripper.as_slice(), gripper.as_slice()].concat());
        Ok(())
    }
}

/// A user's own task and wrappers change what is observed, and the bodies are still shown.
#[test]
fn every_position_of_a_goal_is_shown_through_wrappers() -> Result {
    let env = make("FetchReach-v4")?;
    let time = TimeAwareObservation::new(env.max_episode_steps());
    let mut env = env.into_inner().with_task(Two)?.time_limited().wrap(time)?;
    let mut policy = ScriptedPolicy::new(Task::Reach);
    let html = episode_page(&mut env, &mut policy, 0)?;
    assert_well_formed(&html);
    assert!(html.contains("The red balls are the goal"));
    let episode = episode_in(&html)?;
    assert_eq!(episode["goals"], serde_json::json!([[1.3, 0.7, 0.5], [1.4, 0.8, 0.6]]));
    assert!(episode["bodies"].as_array().is_some_and(|bodies| bodies.len() > 10));
    Ok(())
}

/// An infinite plane has no size.
#[test]
fn an_infinite_plane_is_drawn() -> Result {
    let plane = r#"<worldbody><geom type="plane" size="0 0 1" contype="0"
        conaffinity="0"/></worldbody>"#;
    let model = ModelSource::Extended(Extension::default().with_xml(plane));
    let config = FetchConfig::new(Task::Reach, RewardKind::Sparse).with_model(model);
    let mut policy = ScriptedPolicy::new(Task::Reach);
    let episode = episode_in(&episode_page(&mut make(config)?, &mut policy, 0)?)?;
    let shapes = episode["shapes"].as_array().ok_or("no shapes")?;
    let planes: Vec<_> = shapes.iter().filter(|shape| shape["shape"] == "plane").collect();
    assert!(planes.iter().any(|plane| plane["size"] == serde_json::json!([10.0, 10.0, 0.0])));
    assert!(planes.iter().all(|plane| plane["size"][0] != 0.0), "{planes:?}");
    Ok(())
}

impl PlaybackEnv for Plane {}

#[test]
fn what_has_no_scene_is_plotted() -> Result {
    let mut env = Plane::make()?;
    let mut policy = RandomPolicy::new(env.action_space(), 1);
    let playback = Playback::record(&mut env, &mut policy, 4, |_, _, _| ())?;
    assert_eq!(playback.num_steps(), STEPS as usize);
    let html = playback.html()?;
    assert!(html.contains("Episode, seed 4") && !html.contains("<script"), "{html}");
    // Rewards, distances, two elements of goals and two of observations.
    assert_eq!(html.matches("<svg ").count(), 6);
    for title in ["Reward", "Distance to the goal", "Goal 1", "Observation 1"] {
        assert!(html.contains(&format!("aria-label=\"{title}\"")), "{title}");
    }
    let mut page = Document::new("Plane");
    page.push(&html);
    assert_well_formed(&page.html());

    let mut kinematic = make_kinematic("FetchPush-v4")?;
    let html = episode_page(&mut kinematic, &mut ScriptedPolicy::new(Task::Push), 0)?;
    assert!(html.contains("<h1>FetchPush-v4, seed 0</h1>"));
    assert_eq!(html.matches("<svg ").count(), 2 + 3 + 25);
    Ok(())
}

/// Draws the plane: the goal is red and the point blue.
#[derive(Clone, Debug)]
struct Drawn {
    plane: Plane,
    side: usize,
    /// The number of bytes more than the picture has.
    excess: usize,
}

impl Drawn {
    fn rgb(&self) -> Vec<u8> {
        let mut rgb = vec![255; 3 * self.side * self.side + self.excess];
        let mut dot = |[x, y]: [f64; 2], color: [u8; 3]| {
            let pixel = |at: f64| ((0.5 + at / 5.0) * self.side as f64) as usize;
            let first = 3 * (pixel(y) * self.side + pixel(x));
            rgb[first..first + 3].copy_from_slice(&color);
        };
        dot(self.plane.goal, [200, 0, 0]);
        dot(self.plane.at.map(f64::from), [0, 0, 200]);
        rgb
    }
}

impl Env for Drawn {
    type Observation = <Plane as Env>::Observation;
    type Info = <Plane as Env>::Info;
    type ActionSpace = <Plane as Env>::ActionSpace;
    type ResetOptions = ();

    fn reset_with(
        &mut self,
        seed: Option<u64>,
        options: &(),
    ) -> Result<Reset<Self::Observation, Self::Info>, EnvError> {
        self.plane.reset_with(seed, options)
    }

    fn step(&mut self, action: &[f32]) -> Result<Step<Self::Observation, Self::Info>, EnvError> {
        self.plane.step(action)
    }

    fn action_space(&self) -> &Self::ActionSpace {
        self.plane.action_space()
    }

    fn observation_space(&self) -> &Space {
        self.plane.observation_space()
    }
}

impl GoalEnv for Drawn {
    type GoalReward = <Plane as GoalEnv>::GoalReward;

    fn goal_reward(&self) -> &Self::GoalReward {
        self.plane.goal_reward()
    }
}

impl PlaybackEnv for Drawn {
    fn scene(&self) -> Scene<'_> {
        Scene::Picture { rgb: self.rgb(), width: self.side, height: self.side }
    }
}

impl Drawn {
    fn page(side: usize, excess: usize) -> Result<String> {
        let limited = Plane::make()?;
        let limit = *limited.wrapper();
        let mut env = Self { plane: limited.into_inner(), side, excess }.wrap(limit)?;
        let mut policy = RandomPolicy::new(env.action_space(), 1);
        Ok(episode_page(&mut env, &mut policy, 0)?)
    }
}

#[test]
fn pictures_of_an_environment_are_played() -> Result {
    for (side, shown) in [(100, 100), (1000, 334)] {
        let html = Drawn::page(side, 0)?;
        assert_well_formed(&html);
        assert!(html.len() < 200_000, "{} bytes", html.len());
        let episode = episode_in(&html)?;
        let pictures = episode["pictures"].as_array().ok_or("no list")?;
        assert_eq!(pictures.len(), STEPS as usize + 1);
        assert_ne!(pictures[0], pictures[STEPS as usize]);
        for picture in pictures {
            let url = picture.as_str().ok_or("no text")?;
            let base64 = url.strip_prefix("data:image/png;base64,").ok_or("no picture")?;
            let bytes = BASE64_STANDARD.decode(base64)?;
            let reader = png::Decoder::new(Cursor::new(bytes)).read_info()?;
            assert_eq!((reader.info().width, reader.info().height), (shown, shown));
        }
    }
    let error = Drawn::page(100, 3).expect_err("too many bytes");
    assert!(error.to_string().contains("30003 bytes"), "{error}");
    Ok(())
}
