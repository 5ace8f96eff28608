//! Finished episodes as an archive of numpy arrays.
//!
//! For `E` episodes of `N` transitions together, each state stored once:
//!
//! | array | shape | type |
//! |---|---|---|
//! | `episode_lengths` | `E` | integers |
//! | `observations`, `achieved_goals` | `N + E` rows | `f4` or `f8` |
//! | `desired_goals` | `E` rows | `f4` or `f8` |
//! | `actions`, `rewards` | `N` rows | `f4` or `f8` |
//! | `terminated`, `truncated` | `E` | booleans |
//! | `fields_NAME` for each field | `N` rows | `f4` or `f8` |

mod array;
mod error;
mod export;
mod import;

pub use error::NpzError;

use crate::{BufferConfig, Field};

/// The array of each part of an episode, and how many numbers a row of it has.
struct Arrays {
    observations: (String, usize),
    achieved_goals: (String, usize),
    desired_goals: (String, usize),
    actions: (String, usize),
    rewards: (String, usize),
    fields: Vec<(String, usize)>,
}

const EPISODE_LENGTHS: &str = "episode_lengths";
const TERMINATED: &str = "terminated";
const TRUNCATED: &str = "truncated";

impl Arrays {
    fn new(config: &BufferConfig) -> Self {
        let dims = config.dims;
        let field = |field: &Field| (format!("fields_{}", field.name), field.len);
        Self {
            observations: ("observations".to_owned(), dims.observation),
            achieved_goals: ("achieved_goals".to_owned(), dims.goal),
            desired_goals: ("desired_goals".to_owned(), dims.goal),
            actions: ("actions".to_owned(), dims.action),
            rewards: ("rewards".to_owned(), 1),
            fields: config.fields.iter().map(field).collect(),
        }
    }
}
