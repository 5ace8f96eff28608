//! Learns a task and prints its curve: `cargo run --release --features learn --example learn`.
use baselines::learn::{TrainSettings, Trainer};
use fetch_env::{Task, make};
use std::ops::ControlFlow;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arg = |n: usize| std::env::args().nth(n);
    let task = match arg(1).as_deref() {
        Some("push") => Task::Push,
        Some("pick") => Task::PickAndPlace,
        Some("slide") => Task::Slide,
        _ => Task::Reach,
    };
    let id = format!(
        "Fetch{}-v4",
        match task {
            Task::Push => "Push",
            Task::PickAndPlace => "PickAndPlace",
            Task::Slide => "Slide",
            _ => "Reach",
        }
    );
    let seed = arg(2).map_or(1, |s| s.parse().unwrap());
    let steps = arg(3).map_or(4000, |s| s.parse().unwrap());
    let threads = arg(4).map_or(2, |s| s.parse().unwrap());
    let mut settings = TrainSettings::fast(task);
    if let Some(json) = arg(5) {
        let mut v = serde_json::to_value(&settings)?;
        for kv in json.split(',') {
            let (k, x) = kv.split_once('=').unwrap();
            set(&mut v, k, &serde_json::from_str(x)?);
        }
        settings = serde_json::from_value(v)?;
    }
    let mut trainer = Trainer::new(|| make(&id), settings, seed, threads)?;
    let mut last = 0.0;
    trainer.run(steps, None, |_, row| {
        println!(
            "{:8} steps {:7} updates {:7.2} s  success {:.2} collected {:.2}  {:?}",
            row.counters.steps,
            row.counters.updates,
            row.counters.seconds,
            row.success_rate.value,
            row.collected_success.unwrap_or(f64::NAN),
            row.losses
        );
        let s = row.success_rate.value;
        let target = if task == Task::Reach { 1.0 } else { 0.95 };
        let done = s >= target && last >= target;
        last = s;
        if done { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })?;
    Ok(())
}
fn set(v: &mut serde_json::Value, k: &str, x: &serde_json::Value) {
    if let Some(m) = v.as_object_mut() {
        if m.contains_key(k) {
            m.insert(k.into(), x.clone());
        } else {
            m.values_mut().for_each(|c| set(c, k, x));
        }
    }
}
