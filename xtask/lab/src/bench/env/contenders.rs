//! The contenders: one environment, a bare loop of `mj_step`, and many environments together.

use std::{
    sync::Arc,
    thread::{self, ScopedJoinHandle},
};

use anyhow::{anyhow, ensure};
use fetch_env::{
    Env, MujocoEnv,
    vec_env::{AutoresetMode, VecConfig, VecEnv},
};
use fetch_sim::{BodyId, Data};
use nalgebra::{Quaternion, Vector3};

use super::episodes::{EPISODES, Episodes, SEED, STEPS, random_actions};
use crate::bench::interleaved::Contender;

/// A single environment. Its time includes its resets.
pub struct Single {
    episodes: Arc<Episodes>,
    env: MujocoEnv,
    episode: usize,
}

impl Single {
    pub fn new(episodes: &Arc<Episodes>) -> anyhow::Result<Self> {
        Ok(Self { episodes: Arc::clone(episodes), env: episodes.env()?, episode: 0 })
    }
}

impl Contender for Single {
    fn work(&mut self) -> anyhow::Result<usize> {
        self.env.reset(self.episodes.seed(self.episode))?;
        for action in self.episodes.actions(self.episode) {
            self.env.step(action)?;
        }
        self.episode += 1;
        Ok(STEPS)
    }
}

/// A contender that works several times in a turn.
pub struct Repeated<C> {
    pub contender: C,
    pub times: usize,
}

impl<C: Contender> Contender for Repeated<C> {
    fn work(&mut self) -> anyhow::Result<usize> {
        (0..self.times).map(|_| self.contender.work()).sum()
    }
}

/// The least that a step needs of MuJoCo: the targets of gripper and fingers, and 20 x `mj_step`.
pub struct BareLoop {
    episodes: Arc<Episodes>,
    data: Data,
    mocap: usize,
    gripper: BodyId,
    /// Indices of the fingers in `qpos`, in the order of their actuators.
    fingers: [usize; 2],
    forward: bool,
    episode: usize,
}

impl BareLoop {
    pub fn new(episodes: &Arc<Episodes>) -> anyhow::Result<Self> {
        let model = episodes.model.model();
        let mocap = model.mocap_index(model.body("robot0:mocap")?)?;
        let finger = |side| -> anyhow::Result<usize> {
            let joint = model.joint(&format!("robot0:{side}_gripper_finger_joint"))?;
            Ok(model.qpos_address(joint)?)
        };
        Ok(Self {
            data: Data::new(Arc::clone(model))?,
            mocap: mocap.ok_or_else(|| anyhow!("the model has no mocap body"))?,
            gripper: model.body("robot0:gripper_link")?,
            fingers: [finger("l")?, finger("r")?],
            forward: false,
            episode: 0,
            episodes: Arc::clone(episodes),
        })
    }

    /// Returns the whole physics of an environment's step: with the contact filter and, if the
    /// fingers are held closed, the `mj_forward` that the reference computes afterwards.
    pub fn with_forward(episodes: &Arc<Episodes>) -> anyhow::Result<Self> {
        let forward = episodes.config.task().block_gripper();
        let mut physics = Self { forward, ..Self::new(episodes)? };
        physics.data.set_contact_filter(true)?;
        Ok(physics)
    }

    fn reset(&mut self) -> anyhow::Result<()> {
        self.data.reset()?;
        self.data.qpos_mut().copy_from_slice(self.episodes.start(self.episode));
        self.data.qvel_mut().copy_from_slice(self.episodes.model.start().1);
        self.data.forward()?;
        Ok(())
    }

    fn step(&mut self, action: [f32; 4]) -> anyhow::Result<()> {
        let [x, y, z] = [0, 1, 2].map(|axis| f64::from(action[axis] * 0.05));
        let fingers = f64::from(action[3]);
        let (position, orientation) = self.data.body_pose(self.gripper)?;
        let target = position + Vector3::new(x, y, z);
        // The reference adds this to the gripper's quaternion.
        let down = Quaternion::new(1.0, 0.0, 1.0, 0.0);
        self.data.set_mocap_pose(self.mocap, target, orientation + down)?;
        let blocked = self.episodes.config.task().block_gripper();
        if !blocked {
            let targets = self.fingers.map(|qpos| self.data.qpos()[qpos] + fingers);
            self.data.ctrl_mut().copy_from_slice(&targets);
        }
        self.data.step(self.episodes.config.sim().n_substeps().get())?;
        if blocked {
            for qpos in self.fingers {
                self.data.qpos_mut()[qpos] = 0.0;
            }
        }
        if self.forward {
            self.data.forward()?;
        }
        Ok(())
    }
}

impl Contender for BareLoop {
    fn work(&mut self) -> anyhow::Result<usize> {
        self.reset()?;
        for step in 0..STEPS {
            self.step(self.episodes.actions(self.episode)[step])?;
        }
        self.episode += 1;
        Ok(STEPS)
    }
}

/// Returns many environments stepped together, each for one episode.
pub fn together(
    episodes: &Episodes,
    num_envs: usize,
    threads: usize,
) -> anyhow::Result<impl Contender + use<>> {
    let envs: anyhow::Result<Vec<_>> = (0..num_envs).map(|_| episodes.env()).collect();
    // Every step is a transition in every environment, and its time includes the resets.
    let config =
        VecConfig::default().with_num_threads(threads).with_autoreset(AutoresetMode::SameStep);
    let mut envs = VecEnv::new(envs?, config)?;
    envs.reset(Some(SEED))?;
    let actions = random_actions(EPISODES * STEPS * num_envs).into_flattened();
    let mut batches = (0..EPISODES * STEPS).cycle();
    Ok(move || {
        for batch in batches.by_ref().take(STEPS) {
            let actions = &actions[batch * 4 * num_envs..][..4 * num_envs];
            let batch = envs.step(actions)?;
            ensure!(batch.errors().next().is_none(), "{:?}", batch.errors().next());
        }
        Ok(num_envs * STEPS)
    })
}

/// Returns the same number of environments, each for one episode, on threads that share nothing:
/// the upper bound of what the machine's cores can do.
pub fn apart(
    episodes: &Arc<Episodes>,
    num_envs: usize,
    threads: usize,
) -> anyhow::Result<impl Contender + use<>> {
    let part = |thread| {
        let envs = (thread..num_envs).step_by(threads);
        envs.map(|_| Single::new(episodes)).collect::<anyhow::Result<_>>()
    };
    let mut parts: Vec<Vec<Single>> = (0..threads).map(part).collect::<anyhow::Result<_>>()?;
    Ok(move || {
        thread::scope(|scope| {
            let work = |envs: &mut [Single]| -> anyhow::Result<usize> {
                envs.iter_mut().map(Single::work).sum()
            };
            let running: Vec<_> =
                parts.iter_mut().map(|envs| scope.spawn(move || work(envs))).collect();
            let steps =
                |part: ScopedJoinHandle<'_, _>| part.join().map_err(|_| anyhow!("a panic"))?;
            running.into_iter().map(steps).sum()
        })
    })
}

/// Returns resets of an environment.
pub fn resets(episodes: &Arc<Episodes>) -> anyhow::Result<impl Contender + use<>> {
    let mut single = Single::new(episodes)?;
    Ok(move || {
        for _ in 0..STEPS {
            single.env.reset(single.episodes.seed(single.episode))?;
            single.episode += 1;
        }
        Ok(STEPS)
    })
}

/// Returns the least that a reset needs of MuJoCo: `mj_resetData` and `mj_forward`.
pub fn bare_resets(episodes: &Arc<Episodes>) -> anyhow::Result<impl Contender + use<>> {
    let mut bare = BareLoop::new(episodes)?;
    Ok(move || {
        for _ in 0..STEPS {
            bare.reset()?;
            bare.episode += 1;
        }
        Ok(STEPS)
    })
}

// Both simulate the same physics if the bare loop ends where the environment does.
#[cfg(test)]
mod tests {
    use fetch_env::EnvId;

    use super::*;

    #[test]
    fn the_whole_physics_ends_where_the_environment_does() -> anyhow::Result<()> {
        for id in EnvId::ALL.into_iter().step_by(2) {
            let episodes = Episodes::new(id.config())?;
            let mut single = Single::new(&episodes)?;
            let mut physics = BareLoop::with_forward(&episodes)?;
            for _ in 0..2 {
                single.work()?;
                physics.work()?;
                let simulated = single.env.inner().simulator();
                assert_eq!(simulated.data().qpos(), physics.data.qpos(), "{id}");
                assert_eq!(simulated.data().qvel(), physics.data.qvel(), "{id}");
            }
        }
        Ok(())
    }
}
