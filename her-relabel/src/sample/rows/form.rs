//! The form in which observations and goals are written: as stored, or converted, joined, relative
//! and normalized.

use goal_reward::Dims;

use crate::normalize::difference;
use crate::normalizer::Normalizer;
use crate::sample::error::SampleError;
use crate::sample::rows::batch::Rows;
use crate::sample::rows::copy::{convert_short, put_part, put_start, put_thrice, put_wide};
use crate::scalar::Scalar;
use crate::store::layout::Layout;

/// Writes the parts of transitions of `S` as rows of `T`.
pub(crate) trait Form<S, T>: Copy + Sync {
    /// Writes a part that is neither an observation nor a goal, and not mirrored.
    fn put(self, column: &mut [T], at: usize, part: &[S]);

    /// Writes the action.
    #[inline(always)]
    fn put_action(self, rows: &mut Rows<'_, T>, at: usize, action: &[S]) {
        self.put(rows.columns.action, at, action);
    }

    /// Writes the state before the step, and the goal.
    fn put_state(self, rows: &mut Rows<'_, T>, at: usize, state: State<'_, S>, goal: &[S]);

    /// Writes the state after the step, with the goal of the row.
    fn put_next<G: Scalar>(self, rows: &mut Rows<'_, T>, at: usize, next: State<'_, S>, goal: &[G]);

    /// Writes everything that depends on the goal again, because the goal has moved. The states are
    /// those before and after the step of the row.
    fn put_moved<G: Scalar>(
        self,
        rows: &mut Rows<'_, T>,
        at: usize,
        states: [State<'_, S>; 2],
        goal: &[G],
    );
}

/// The state that a stored row begins with.
#[derive(Clone, Copy)]
pub(crate) struct State<'a, S> {
    pub(crate) layout: &'a Layout,
    pub(crate) row: &'a [S],
}

impl<'a, S> State<'a, S> {
    #[inline(always)]
    pub(crate) fn observation(self) -> &'a [S] {
        &self.row[self.layout.observation()]
    }

    #[inline(always)]
    pub(crate) fn achieved_goal(self) -> &'a [S] {
        &self.row[self.layout.achieved_goal()]
    }
}

/// Every part as it is stored: in its own column, or observations joined with goals.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AsStored<const JOINED: bool>;

impl<T: Scalar, const JOINED: bool> Form<T, T> for AsStored<JOINED> {
    #[inline(always)]
    fn put(self, column: &mut [T], at: usize, part: &[T]) {
        put_part(column, at, part);
    }

    #[inline(always)]
    fn put_state(self, rows: &mut Rows<'_, T>, at: usize, state: State<'_, T>, goal: &[T]) {
        let columns = &mut rows.columns;
        if JOINED {
            let (observation, input) = (state.observation(), state.layout.state().end);
            put_start(&mut columns.input[at * input..], observation);
            let end = at * input + observation.len();
            let desired_goal = &mut columns.desired_goal[at * goal.len()..];
            let (input, next) = (&mut columns.input[end..], &mut columns.next_input[end..]);
            put_thrice([input, next, desired_goal], goal);
        } else {
            put_part(columns.observation, at, state.observation());
            put_part(columns.desired_goal, at, goal);
        }
        put_part(columns.achieved_goal, at, state.achieved_goal());
    }

    #[inline(always)]
    fn put_next<G: Scalar>(self, rows: &mut Rows<'_, T>, at: usize, next: State<'_, T>, _: &[G]) {
        let columns = &mut rows.columns;
        if JOINED {
            put_start(&mut columns.next_input[at * next.layout.state().end..], next.observation());
        } else {
            put_part(columns.next_observation, at, next.observation());
        }
        put_part(columns.next_achieved_goal, at, next.achieved_goal());
    }

    fn put_moved<G: Scalar>(
        self,
        rows: &mut Rows<'_, T>,
        at: usize,
        [state, _]: [State<'_, T>; 2],
        goal: &[G],
    ) {
        let columns = &mut rows.columns;
        let len = goal.len();
        convert_short(&mut columns.desired_goal[at * len..][..len], goal);
        if JOINED {
            let input = state.layout.state().end;
            let start = at * input + input - len;
            convert_short(&mut columns.input[start..][..len], goal);
            convert_short(&mut columns.next_input[start..][..len], goal);
        }
    }
}

/// Any other form: relative goals, normalizers, or another element type.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Formed<'a> {
    pub(crate) observation: Option<&'a Normalizer>,
    pub(crate) goal: Option<&'a Normalizer>,
    /// Whether the goals joined with observations are relative.
    pub(crate) relative: bool,
}

impl Formed<'_> {
    /// Returns whether nothing is normalized or relative.
    pub(crate) fn is_plain(&self) -> bool {
        self.observation.is_none() && self.goal.is_none() && !self.relative
    }

    /// Returns the normalizer of the columns of goals.
    #[inline(always)]
    fn goal_columns(&self) -> Option<&Normalizer> {
        if self.relative { None } else { self.goal }
    }

    /// Writes a relative goal to `target`.
    #[inline(always)]
    fn put_relative<S: Scalar, G: Scalar, T: Scalar>(
        &self,
        target: &mut [T],
        desired: &[G],
        achieved: &[S],
    ) {
        match self.goal {
            Some(normalizer) => normalizer.put_difference(target, desired, achieved),
            None => {
                for (target, value) in target.iter_mut().zip(difference(desired, achieved)) {
                    *target = T::from_f64(value);
                }
            }
        }
    }

    /// Writes an observation followed by the goal to `target`, which has exactly their length.
    pub(crate) fn put_input<O: Scalar, G: Scalar, T: Scalar>(
        &self,
        target: &mut [T],
        observation: &[O],
        achieved_goal: &[G],
        desired_goal: &[G],
    ) {
        let end = observation.len();
        put_at(self.observation, target, 0, observation);
        if self.relative {
            self.put_relative(&mut target[end..], desired_goal, achieved_goal);
        } else {
            put_at(self.goal, target, end, desired_goal);
        }
    }

    /// Returns the length of the vectors and that of their normalizer, if they differ.
    pub(crate) fn wrong_dim(&self, dims: Dims) -> Option<(usize, usize)> {
        let pairs = [(self.observation, dims.observation), (self.goal, dims.goal)];
        pairs.into_iter().find_map(|(normalizer, expected)| {
            let actual = normalizer?.dim();
            (actual != expected).then_some((expected, actual))
        })
    }

    /// Checks the dimensions of the normalizers.
    pub(crate) fn check(&self, dims: Dims) -> Result<(), SampleError> {
        match self.wrong_dim(dims) {
            Some((expected, actual)) => Err(SampleError::NormalizerDim { expected, actual }),
            None => Ok(()),
        }
    }
    /// Writes the state before the step, and the goal.
    #[inline]
    pub(crate) fn write_state<S: Scalar, G: Scalar, T: Scalar>(
        self,
        rows: &mut Rows<'_, T>,
        at: usize,
        state: State<'_, S>,
        goal: &[G],
    ) {
        let Rows { columns, scratch, .. } = rows;
        let (observation, len) = (state.observation().len(), goal.len());
        put_at(self.goal_columns(), columns.achieved_goal, at * len, state.achieved_goal());
        put_at(self.goal_columns(), columns.desired_goal, at * len, goal);
        if columns.input.is_empty() {
            put_at(self.observation, columns.observation, at * observation, state.observation());
        } else {
            let start = at * (observation + len);
            let end = start + observation;
            put_at(self.observation, columns.input, start, state.observation());
            if self.relative {
                self.put_relative(&mut columns.input[end..][..len], goal, state.achieved_goal());
            } else {
                // The goal was just written here, and need not be normalized again.
                let written = &columns.desired_goal[at * len..][..len];
                convert_short(&mut columns.input[end..][..len], written);
                convert_short(&mut columns.next_input[end..][..len], written);
            }
        }
        if !scratch.judged_desired.is_empty() {
            put_wide(scratch.judged_desired, at, goal);
        }
    }
}

impl<S: Scalar, T: Scalar> Form<S, T> for Formed<'_> {
    #[inline(always)]
    fn put(self, column: &mut [T], at: usize, part: &[S]) {
        let len = part.len();
        convert_short(&mut column[at * len..][..len], part);
    }

    #[inline]
    fn put_state(self, rows: &mut Rows<'_, T>, at: usize, state: State<'_, S>, goal: &[S]) {
        self.write_state(rows, at, state, goal);
    }

    #[inline]
    fn put_next<G: Scalar>(
        self,
        rows: &mut Rows<'_, T>,
        at: usize,
        next: State<'_, S>,
        goal: &[G],
    ) {
        let Rows { columns, scratch, .. } = rows;
        let (observation, len) = (next.observation().len(), next.achieved_goal().len());
        put_at(self.goal_columns(), columns.next_achieved_goal, at * len, next.achieved_goal());
        if columns.next_input.is_empty() {
            let start = at * observation;
            put_at(self.observation, columns.next_observation, start, next.observation());
        } else {
            let start = at * (observation + len);
            put_at(self.observation, columns.next_input, start, next.observation());
            if self.relative {
                let target = &mut columns.next_input[start + observation..][..len];
                self.put_relative(target, goal, next.achieved_goal());
            }
        }
        if !scratch.judged_achieved.is_empty() {
            put_wide(scratch.judged_achieved, at, next.achieved_goal());
        }
    }

    fn put_moved<G: Scalar>(
        self,
        rows: &mut Rows<'_, T>,
        at: usize,
        [state, next]: [State<'_, S>; 2],
        goal: &[G],
    ) {
        self.write_state(rows, at, state, goal);
        self.put_next(rows, at, next, goal);
    }
}

/// Writes a part to its place in a column, normalized if there is a normalizer.
#[inline(always)]
fn put_at<S: Scalar, T: Scalar>(
    normalizer: Option<&Normalizer>,
    column: &mut [T],
    start: usize,
    part: &[S],
) {
    let target = &mut column[start..][..part.len()];
    match normalizer {
        None => convert_short(target, part),
        Some(normalizer) => normalizer.put(target, part),
    }
}
