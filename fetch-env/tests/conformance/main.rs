//! Every law of the Fetch environments, over all eight ids, on every simulator.

mod laws;

/// One test for each law, on one simulator.
macro_rules! conformance {
    ($name:ident, $backend:ty) => {
        mod $name {
            use super::laws;

            conformance!(@tests $backend:
                check::the_checker_finds_nothing,
                action::actions_are_clipped_to_the_action_space,
                action::the_fourth_element_moves_the_fingers_where_they_are_free,
                action::each_axis_moves_the_gripper_its_way,
                episode::observations_are_made_as_documented,
                episode::goals_and_objects_start_where_the_reference_puts_them,
                episode::an_episode_lasts_fifty_steps_and_is_never_terminated,
                reset::goals_and_objects_start_where_the_options_say,
                reset::options_do_not_disturb_the_random_numbers,
                reset::impossible_options_are_refused_and_change_nothing,
                reset::the_environment_reports_its_goal,
                reset::the_environment_reports_its_seed,
                reward::the_step_reward_is_the_reward_of_its_goals,
                reward::dense_and_sparse_see_the_same_trajectory,
                start::the_gripper_starts_where_the_option_says_and_nothing_else_changes,
                start::the_object_lies_as_the_options_say,
                start::a_held_object_stays_in_the_hand_and_is_lifted,
                start::impossible_starts_are_refused,
                snapshot::snapshots_survive_json_to_the_last_bit,
                snapshot::foreign_snapshots_are_refused_and_change_nothing,
                snapshot::numbers_that_no_state_can_have_are_refused_and_change_nothing,
                snapshot::a_restored_environment_observes_what_it_did,
                interface::neutral_numbers_change_no_bit,
                interface::actions_are_scaled,
                interface::actions_pass_the_low_pass,
                interface::noise_disturbs_only_what_it_names,
                interface::delayed_observations_come_late_and_goals_in_time,
                interface::noise_of_actions_follows_from_the_seed,
                interface::what_was_observed_is_observed_again,
                variation::a_varied_environment_passes_every_check,
                variation::objects_and_goals_start_where_they_do_without_a_variation,
                variation::no_number_is_drawn_twice,
                variation::a_seed_gives_the_same_numbers_and_steps_again,
                variation::a_snapshot_holds_the_numbers,
                variation::looks_change_no_step,
                variation::options_set_a_number_for_one_episode,
                variation::what_cannot_vary_is_refused,
                variation::delayed_actions_come_late,
                variation::any_number_of_threads_draws_the_same,
            );
        }
    };
    (@tests $backend:ty: $($module:ident::$law:ident,)*) => {$(
        #[test]
        fn $law() -> laws::Result {
            laws::$module::$law::<$backend>()
        }
    )*};
}

conformance!(kinematic, laws::Kinematic);
#[cfg(feature = "mujoco")]
conformance!(mujoco, laws::Mujoco);
