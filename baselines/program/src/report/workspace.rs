//! The sampled goals and objects over the table.

use baselines::page::{Axis, Ink, Plot};
use fetch_env::{Env, EnvId, GoalObservation, Task, make};
use fetch_sim::{Shape, SimConfig, VisualGeom};
use goal_reward::RewardKind;

const RESETS: usize = 400;

/// Returns two plots for each task: from above, and from the robot's right.
pub fn section(seed: u64) -> anyhow::Result<String> {
    let mut html = format!(
        "<p>{RESETS} resets of each task, seeds from {seed} on: the goals, and where the object \
         and the gripper start. The gray area is the table. x points away from the robot, y to its \
         left, z up.</p>\n<div class=\"grid\">\n"
    );
    for task in Task::ALL {
        let [top, side] = Workspace::sample(task, seed)?.plots();
        html += &format!("<div>{}\n{}</div>\n", top.svg()?, side.svg()?);
    }
    Ok(html + "</div>")
}

/// Positions in meters.
struct Workspace {
    task: Task,
    goals: Vec<[f64; 3]>,
    objects: Vec<[f64; 3]>,
    gripper: [f64; 3],
    /// Two opposite corners.
    table: [[f64; 3]; 2],
}

impl Workspace {
    fn sample(task: Task, seed: u64) -> anyhow::Result<Self> {
        let mut env = make(EnvId { task, reward: RewardKind::Sparse }.config())?;
        let mut goals = Vec::with_capacity(RESETS);
        let mut objects = Vec::new();
        let mut gripper = [0.0; 3];
        for seed in (seed..).take(RESETS) {
            let observation = env.reset(Some(seed))?.observation;
            goals.push(observation.desired_goal().try_into()?);
            objects.extend(observation.object_position());
            gripper = observation.grip_position();
        }
        let data = env.inner().simulator().data();
        let body = data.model().body("table0")?;
        let geoms = VisualGeom::of(&SimConfig::new(task))?;
        let half_size = geoms
            .iter()
            .find_map(|geom| match geom.shape {
                Shape::Box { half_size } if geom.body == body => Some(half_size),
                _ => None,
            })
            .ok_or_else(|| anyhow::anyhow!("the table of {task} is not a box"))?;
        let center = data.body_pose(body)?.0;
        let corner = |sign: f64| [0, 1, 2].map(|axis| center[axis] + sign * half_size[axis]);
        Ok(Self { task, goals, objects, gripper, table: [corner(-1.0), corner(1.0)] })
    }

    fn plots(&self) -> [Plot; 2] {
        [self.plot("seen from above", 1, "y (m)"), self.plot("seen from the side", 2, "z (m)")]
    }

    /// Plots x to the right, and the axis `up` upwards.
    fn plot(&self, from: &str, up: usize, label: &str) -> Plot {
        let [low, high] = &self.table;
        let points = || self.goals.iter().chain(&self.objects).chain([&self.gripper]);
        let x = Axis::around("x (m)", points().map(|p| p[0]).chain([low[0], high[0]]));
        // From above the whole table; from the side its upper part, and room above it.
        let table = if up == 1 { [low[up], high[up]] } else { [high[up] - 0.1, high[up] + 0.2] };
        let y = Axis::around(label, points().map(|p| p[up]).chain(table));
        let mut plot = Plot::new(&format!("Fetch{}, {from}", self.task), x, y).with_equal_scale();
        plot.area((low[0], low[up]), (high[0], high[up]));
        let along = |points: &[[f64; 3]]| points.iter().map(|p| (p[0], p[up])).collect::<Vec<_>>();
        plot.dots(Ink::Red, along(&self.goals));
        plot.legend(Ink::Red, "goals");
        if !self.objects.is_empty() {
            plot.dots(Ink::Teal, along(&self.objects));
            plot.legend(Ink::Teal, "objects");
        }
        plot.dot(Ink::Text, (self.gripper[0], self.gripper[up]));
        plot.legend(Ink::Text, "gripper");
        plot
    }
}
