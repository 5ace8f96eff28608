//! The arrays of an archive of finished episodes.
//!
//! For `E` episodes of `N` transitions in total, with each state stored once:
//!
//! | array | shape | type |
//! |---|---|---|
//! | `episode_lengths` | `E` | integers |
//! | `observations`, `achieved_goals` | `N + E` rows | `f4` or `f8` |
//! | `desired_goals` | `E` rows | `f4` or `f8` |
//! | `actions`, `rewards` | `N` rows | `f4` or `f8` |
//! | `terminated`, `truncated` | `E` | booleans |
//! | `fields_NAME` for each field | `N` rows | `f4` or `f8` |

use crate::store::config::BufferConfig;
use crate::store::fields::Field;

/// The name of the array of each part of an episode, and the number of elements of its rows.
pub(crate) struct Arrays {
    pub(crate) observations: (String, usize),
    pub(crate) achieved_goals: (String, usize),
    pub(crate) desired_goals: (String, usize),
    pub(crate) actions: (String, usize),
    pub(crate) rewards: (String, usize),
    pub(crate) fields: Vec<(String, usize)>,
}

pub(crate) const EPISODE_LENGTHS: &str = "episode_lengths";
pub(crate) const TERMINATED: &str = "terminated";
pub(crate) const TRUNCATED: &str = "truncated";

impl Arrays {
    pub(crate) fn new(config: &BufferConfig) -> Self {
        let dims = config.dims();
        let field = |field: &Field| (format!("fields_{}", field.name), field.len);
        Self {
            observations: ("observations".to_owned(), dims.observation),
            achieved_goals: ("achieved_goals".to_owned(), dims.goal),
            desired_goals: ("desired_goals".to_owned(), dims.goal),
            actions: ("actions".to_owned(), dims.action),
            rewards: ("rewards".to_owned(), 1),
            fields: config.fields().iter().map(field).collect(),
        }
    }
}
