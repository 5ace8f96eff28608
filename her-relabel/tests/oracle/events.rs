//! Random events and settings of a buffer.

use her_relabel::{BufferConfig, Dims, NewPriority, Priorities, PriorityUnit};
use proptest::prelude::*;

/// An event. Environments are numbered modulo their number.
#[derive(Clone, Debug)]
pub(crate) enum Event {
    /// A step, after a start if there is no episode under way; with its flags.
    Step(usize, (bool, bool)),
    End(usize),
    Discard(usize),
    /// A whole episode of this number of steps.
    Whole(usize, (bool, bool)),
    /// The rows of some environments: whether each is stepped, terminated, truncated, started.
    Record([[bool; 4]; 3]),
    /// New priorities of some transitions.
    Prioritize(Vec<(prop::sample::Index, u8)>),
    Clear,
    SaveAndLoad,
    /// All finished episodes once more.
    Append,
    /// All finished episodes once more, as an archive of numpy arrays.
    Import,
}

fn flags() -> impl Strategy<Value = (bool, bool)> {
    prop_oneof![
        8 => Just((false, false)),
        1 => Just((true, false)),
        1 => Just((false, true)),
        1 => Just((true, true)),
    ]
}

pub(crate) fn event() -> impl Strategy<Value = Event> {
    let end = (0..3_u8).prop_map(|end| (end != 1, end != 0));
    let changes = prop::collection::vec((any::<prop::sample::Index>(), 0_u8..5), 1..5);
    let rare = || prop::bool::weighted(0.15);
    let row = (any::<bool>(), rare(), rare(), rare()).prop_map(<[bool; 4]>::from);
    prop_oneof![
        30 => (0..3_usize, flags()).prop_map(|(env, flags)| Event::Step(env, flags)),
        20 => prop::array::uniform3(row).prop_map(Event::Record),
        6 => (1..12_usize, end).prop_map(|(len, end)| Event::Whole(len, end)),
        4 => changes.prop_map(Event::Prioritize),
        2 => (0..3_usize).prop_map(Event::End),
        1 => (0..3_usize).prop_map(Event::Discard),
        1 => Just(Event::Clear),
        2 => Just(Event::SaveAndLoad),
        1 => Just(Event::Append),
        1 => Just(Event::Import),
    ]
}

pub(crate) fn config() -> impl Strategy<Value = BufferConfig> {
    let dims = (1..4_usize, 1..5_usize, 1..4_usize);
    let capacity = prop_oneof![1..12_usize, 60..70_usize, Just(150)];
    let fields = prop::collection::vec(1..4_usize, 0..4);
    let new = prop_oneof![Just(NewPriority::Highest), Just(NewPriority::Given(0.5))];
    let unit = prop_oneof![Just(PriorityUnit::Transition), Just(PriorityUnit::Episode)];
    let priorities =
        (unit, new).prop_map(|(unit, new)| Priorities::new(unit).with_new_priority(new));
    let others = (1..4_usize, fields, prop::option::of(priorities));
    (capacity, dims, others).prop_map(|(capacity, dims, (num_envs, fields, priorities))| {
        let (observation, goal, action) = dims;
        let config = BufferConfig::new(capacity, Dims { observation, goal, action });
        let config = config.with_num_envs(num_envs).with_priorities(priorities);
        let fields = fields.into_iter().enumerate();
        fields.fold(config, |config, (at, len)| config.with_field(format!("field_{at}"), len))
    })
}
