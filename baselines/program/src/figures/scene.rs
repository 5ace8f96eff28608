//! The scene of a task after a reset.

use fetch_env::clip::write_png;
use fetch_env::{
    Env, EnvId, FetchObservation, GoalObservation, RenderEnv, RenderError, RenderOptions, make,
};
use fetch_sim::Task;
use goal_reward::{RewardKind, goal_distance};
use plotters::prelude::*;

use super::{
    canvas::{FAINT, INK, bold, centered, text},
    picture::{Area, Backend, DrawError, Drawing, Frame},
};

pub struct Scene {
    id: EnvId,
    seed: u64,
    observation: FetchObservation,
    /// The picture, or the reason why there is none.
    rgb: Result<Vec<u8>, RenderError>,
}

const SIDE: u32 = 560;
const MARGIN: u32 = 20;
/// Height of the title above the picture.
const TOP: u32 = 84;
/// Height of the positions below it.
const BOTTOM: u32 = 116;

impl Scene {
    pub fn after_reset(task: Task, seed: u64) -> anyhow::Result<Self> {
        let id = EnvId { task, reward: RewardKind::Sparse };
        let mut env = make(id)?;
        let observation = env.reset(Some(seed))?.observation;
        let options = RenderOptions::default().with_width(SIDE).with_height(SIDE);
        let rgb = match env.renderer(options) {
            Ok(mut renderer) => Ok(env.render(&mut renderer)?.to_vec()),
            Err(error) => match error.downcast_ref() {
                Some(missing @ RenderError::NoOpenGl { .. }) => Err(missing.clone()),
                _ => return Err(error.into()),
            },
        };
        Ok(Self { id, seed, observation, rgb })
    }

    /// Returns the picture alone as PNG, or the reason why there is none.
    pub fn png(&self) -> Result<Vec<u8>, String> {
        let rgb = self.rgb.as_ref().map_err(ToString::to_string)?;
        let mut png = Vec::new();
        write_png(rgb, SIDE, SIDE, &mut png).map_err(|error| error.to_string())?;
        Ok(png)
    }

    fn what_to_do(&self) -> &'static str {
        match self.id.task {
            Task::Reach => "Task: move the gripper to the red target",
            Task::Push => "Task: push the block to the red target, gripper closed",
            Task::PickAndPlace => "Task: lift the block to the red target",
            Task::Slide => "Task: strike the puck so that it slides to the red target",
        }
    }

    /// Returns the positions with their names. If there is an object, its position is the achieved
    /// goal; otherwise the gripper's is.
    fn positions(&self) -> Vec<(&'static str, [f64; 3])> {
        let (gripper, goal) = (self.observation.grip_position(), self.observation.desired_goal());
        let target = ("target (desired_goal)", [goal[0], goal[1], goal[2]]);
        match self.observation.object_position() {
            None => vec![("gripper (achieved_goal)", gripper), target],
            Some(object) => vec![("gripper", gripper), ("object (achieved_goal)", object), target],
        }
    }
}

impl Drawing for Scene {
    fn size(&self) -> (u32, u32) {
        (SIDE + 2 * MARGIN, SIDE + TOP + BOTTOM)
    }

    fn draw<B: Backend>(&self, area: &Area<B>) -> Result<(), DrawError> {
        let left = MARGIN as i32;
        area.draw_text(&format!("{} after reset", self.id), &bold(24), (left, 28))?;
        area.draw_text(self.what_to_do(), &text(17, INK), (left, 60))?;
        if let Err(missing) = &self.rgb {
            let (top, side) = (TOP as i32, SIDE as i32);
            let place = Rectangle::new([(left, top), (left + side, top + side)], FAINT);
            area.draw(&place)?;
            for (y, line) in (top + side / 2 - 60..).step_by(24).zip(wrapped(&missing.to_string()))
            {
                area.draw_text(&line, &centered(16, INK), (left + side / 2, y))?;
            }
        }
        let mut y = (TOP + SIDE) as i32 + 22;
        for (name, position) in self.positions() {
            area.draw_text(name, &text(15, INK), (left, y))?;
            let [px, py, pz] = position;
            let position = format!("x {px:.3}  y {py:.3}  z {pz:.3} m");
            area.draw_text(&position, &text(15, INK), (left + 230, y))?;
            y += 22;
        }
        let goals = (self.observation.achieved_goal(), self.observation.desired_goal());
        let distance = goal_distance(goals.0, goals.1);
        let line = format!("distance {distance:.3} m; seed {}", self.seed);
        area.draw_text(&line, &text(15, FAINT), (left, y))?;
        Ok(())
    }

    fn frame(&self) -> Option<Frame<'_>> {
        let at = (MARGIN as usize, TOP as usize);
        self.rgb.as_ref().ok().map(|rgb| Frame { at, size: (SIDE, SIDE), rgb })
    }
}

/// Wraps a text into lines of up to 56 letters.
fn wrapped(text: &str) -> Vec<String> {
    text.split_whitespace().fold(Vec::new(), |mut lines: Vec<String>, word| {
        match lines.last_mut() {
            Some(line) if line.len() + 1 + word.len() <= 56 => *line += &format!(" {word}"),
            _ => lines.push(word.into()),
        }
        lines
    })
}
