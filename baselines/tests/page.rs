//! Pages that play episodes back, without a browser.

use baselines::{
    Policy, RandomPolicy, ScriptedPolicy,
    page::{Axis, Document, Ink, PageError, Playback, Plot, episode_page},
};
use fetch_env::{
    Env, EnvId, FetchConfig, FetchObservation, GoalObservation, ModelSource, Task, make,
};
use goal_reward::RewardKind;
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
    assert!((0..3).all(|axis| near(&episode["goal"][axis], goal[axis])));
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
    // A single value still makes an axis, and points that are no numbers stay within it.
    let mut plot = Plot::new("one value", Axis::around("x", [1.0]), Axis::new("y", 2.0, 2.0));
    plot.line(Ink::Blue, [(f64::NAN, f64::INFINITY), (1.0, 2.0)]);
    assert!(!plot.svg()?.contains("NaN"));

    let foreign =
        FetchConfig::new(Task::Reach, RewardKind::Sparse).with_model(ModelSource::Reference);
    if let Ok(mut env) = make(foreign) {
        let mut policy = RandomPolicy::new(env.action_space(), 0);
        let error = Playback::record(&mut env, &mut policy, 0, |_, _, _| ()).err();
        assert!(matches!(error, Some(PageError::ForeignModel)), "{error:?}");
    }
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
