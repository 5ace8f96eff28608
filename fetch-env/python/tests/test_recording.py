"""A buffer stores what happened, or says why it does not."""

import copy
import pickle

import fetch_env
import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, VectorWrapper
from gymnasium.wrappers import vector as wrappers

NUM_ENVS = 2


class Spy:
    """Keeps every transition of a vector, computed from what its calls return."""

    def __init__(self, envs):
        self.envs = envs
        self.happened = set()

    def reset(self, **settings):
        self.shown, _ = self.envs.reset(**settings)

    def step(self, actions):
        after, _, _, _, infos = self.envs.step(actions)
        for env_index in range(NUM_ENVS):
            final = infos.get("_final_obs", np.zeros(NUM_ENVS, bool))[env_index]
            row = infos["final_obs"][env_index] if final else rows(after, env_index)
            self.happened.add(transition(rows(self.shown, env_index), actions[env_index], row))
        self.shown = after


def rows(observations, env_index):
    return {key: numbers[env_index] for key, numbers in observations.items()}


def transition(before, action, after):
    parts = [before[key] for key in ("observation", "achieved_goal", "desired_goal")]
    parts += [action, after["observation"], after["achieved_goal"]]
    return b"".join(np.asarray(part, np.float32).tobytes() for part in parts)


def refusal(buffer, envs):
    """Record, and return what is wrong with that."""
    try:
        buffer.record(envs)
    except ValueError as error:
        return str(error).split(":")[0]
    return ""


def stored(buffer):
    """Return all transitions that a buffer draws without hindsight."""
    batch = buffer.sample(50 * len(buffer), k=0, seed=1)
    columns = "observation", "achieved_goal", "desired_goal", "action"
    columns += "next_observation", "next_achieved_goal"
    columns = [batch[column] for column in columns]
    return {b"".join(part.tobytes() for part in row) for row in zip(*columns, strict=True)}


@pytest.fixture
def envs():
    return fetch_env.FetchVectorEnv(
        "FetchReach-v4", NUM_ENVS, autoreset_mode="SameStep", max_episode_steps=5
    )


def test_forgotten_and_doubled_results_are_errors_and_store_nothing(envs):
    envs.action_space.seed(0)
    buffer, spy = fetch_env.HerBuffer(envs, 1000), Spy(envs)
    random = np.random.default_rng(0)
    messages = set()
    spy.reset(seed=0)
    for time in range(300):
        if random.random() < 0.1:
            spy.reset()
        else:
            spy.step(envs.action_space.sample())
        for _ in range(random.choice(3, p=(0.1, 0.8, 0.1))):
            message = refusal(buffer, envs)
            messages.add(message[-20:])
            if message and random.random() < 0.5:
                buffer.resume(envs)
        if time % 60 == 59:
            buffer = pickle.loads(pickle.dumps(buffer))
    assert len(messages) >= 4
    assert len(stored(buffer)) > 100
    assert stored(buffer) <= spy.happened


def test_rows_have_the_goals_that_a_vector_had_in_their_steps():
    envs = fetch_env.FetchVectorEnv("FetchReachDense-v4", 3, max_episode_steps=8)
    with pytest.raises(gymnasium.error.ResetNeeded):
        envs.set_attr("goal", np.zeros(3))
    buffer = fetch_env.HerBuffer(envs, 1000)
    envs.reset(seed=0)
    buffer.record(envs)
    goals = np.array(envs.get_attr("goal"))
    for wrong in (np.zeros(4), np.zeros((2, 3)), [[0.0] * 3, [np.nan] * 3, [0.0] * 3]):
        with pytest.raises(ValueError, match="goal"):
            envs.set_attr("goal", wrong)
    np.testing.assert_array_equal(envs.get_attr("goal"), goals)
    envs.action_space.seed(0)
    happened = {}
    for time in range(40):
        if time % 3 == 1:
            goals[1] += 0.01
            envs.set_attr("goal", goals if time % 2 else goals[1])
        goals = np.array(envs.get_attr("goal"))
        actions = envs.action_space.sample()
        observations, rewards, *_, infos = envs.step(actions)
        buffer.record(envs)
        for env_index in np.flatnonzero(infos.get("_is_success", [])):
            np.testing.assert_array_equal(observations["desired_goal"][env_index], goals[env_index])
            happened[actions[env_index].tobytes()] = goals[env_index].copy(), rewards[env_index]
    for env_index in range(3):
        if buffer.unfinished_steps(env_index=env_index):
            buffer.end_episode(env_index=env_index)
    assert len(buffer) == len(happened)
    batch = buffer.sample(20 * len(buffer), k=0, seed=0)
    pairs = batch["next_achieved_goal"].astype(float), batch["desired_goal"].astype(float)
    np.testing.assert_allclose(batch["reward"], envs.compute_reward(*pairs, {}), atol=1e-6)
    columns = (batch[name] for name in ("action", "desired_goal", "reward"))
    for action, goal, reward in zip(*columns, strict=True):
        expected = happened[action.tobytes()]
        np.testing.assert_array_equal(goal, expected[0].astype(np.float32))
        assert reward == np.float32(expected[1])


def test_the_message_says_what_is_missing(envs, actions):
    buffer = fetch_env.HerBuffer(envs, 100)
    envs.reset(seed=0)
    buffer.record(envs)
    with pytest.raises(ValueError, match="environment 0 was recorded before"):
        buffer.record(envs)
    for _ in range(3):
        envs.step(actions[:NUM_ENVS])
    with pytest.raises(ValueError, match="2 rows of environment 0 before this one were not"):
        buffer.record(envs)
    envs.step_async(actions[:NUM_ENVS])
    with pytest.raises(ValueError, match="call resume"):
        buffer.record(envs)
    envs.step_wait()
    envs.reset()
    buffer.record(envs)
    assert (len(buffer), buffer.unfinished_steps()) == (0, 0)


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_every_call_is_recorded_in_every_mode(mode, actions):
    envs = fetch_env.FetchVectorEnv(
        "FetchReach-v4", NUM_ENVS, autoreset_mode=mode, max_episode_steps=3
    )
    buffer = fetch_env.HerBuffer(envs, 100)
    mask = np.array([False, True])
    envs.reset(seed=0)
    buffer.record(envs)
    for step in range(10):
        *_, truncated, _ = envs.step(actions[step : step + NUM_ENVS])
        buffer.record(envs)
        if mode == AutoresetMode.DISABLED and truncated.any():
            envs.reset(options={"reset_mask": truncated})
            buffer.record(envs)
        elif step == 4:
            envs.reset(options={"reset_mask": mask})
            buffer.record(envs)
    assert buffer.num_episodes >= 4


def test_copies_go_on_with_copies_of_the_environments_only(envs, actions):
    buffer = fetch_env.HerBuffer(envs, 100)
    envs.reset(seed=0)
    buffer.record(envs)
    envs.step(actions[:NUM_ENVS])
    buffer.record(envs)
    for copied in (copy.deepcopy, lambda parts: pickle.loads(pickle.dumps(parts))):
        other_envs, other = copied((envs, buffer))
        other.resume(other_envs)
        other_envs.step(actions[:NUM_ENVS])
        other.record(other_envs)
        assert other.unfinished_steps() == 2
        with pytest.raises(ValueError, match="another episode than the one under way"):
            buffer.record(other_envs)
    replaced = fetch_env.FetchVectorEnv("FetchReach-v4", NUM_ENVS)
    replaced.reset(seed=0)
    replaced.step(actions[:NUM_ENVS])
    with pytest.raises(ValueError, match="another episode than the one under way"):
        buffer.record(replaced)
    assert buffer.unfinished_steps() == 1


class Noisy(VectorWrapper):
    """A wrapper that the buffer does not know."""

    def step(self, actions):
        return self.env.step(actions * 0.5)


class Halved(fetch_env.FetchVectorEnv):
    """A subclass that takes other actions."""

    def step(self, actions):
        return super().step(actions * 0.5)


class Named(fetch_env.FetchVectorEnv):
    """A subclass that changes nothing that is recorded."""

    name = "mine"


def rescaled(envs):
    limits = np.full(4, 2.0, np.float32)
    return wrappers.RescaleAction(envs, -limits, limits)


@pytest.mark.parametrize(
    "wrap",
    [
        wrappers.ClipAction,
        rescaled,
        lambda envs: wrappers.TransformReward(envs, lambda reward: reward * 2.0),
        lambda envs: wrappers.ClipReward(envs, -0.5, 0.5),
        lambda envs: wrappers.FilterObservation(envs, ["observation"]),
        Noisy,
        lambda envs: wrappers.RecordEpisodeStatistics(Noisy(envs)),
        lambda envs: Noisy(wrappers.RecordEpisodeStatistics(envs)),
    ],
)
def test_a_wrapper_that_may_change_something_is_named(wrap):
    envs = fetch_env.FetchVectorEnv("FetchReach-v4", NUM_ENVS)
    wrapped = wrap(envs)
    buffer = fetch_env.HerBuffer(envs, 100)
    wrapped.reset(seed=0)
    name = next(
        kind.__name__
        for kind in map(type, (wrapped, wrapped.env))
        if kind is not wrappers.RecordEpisodeStatistics
    )
    for record in (buffer.record, buffer.resume):
        with pytest.raises(TypeError, match=rf"^{name} may change .*record envs\.unwrapped"):
            record(wrapped)
    buffer.record(wrapped.unwrapped)
    assert buffer.unfinished_steps() == 0


def test_wrappers_that_only_look_are_recorded(envs, actions):
    buffer = fetch_env.HerBuffer(envs, 100)
    looking = wrappers.DictInfoToList(wrappers.RecordEpisodeStatistics(VectorWrapper(envs)))
    spy = Spy(envs)
    envs.reset(seed=0)
    for each in (looking, Named("FetchReach-v4", NUM_ENVS)):
        each.reset(seed=0)
        buffer.record(each)
        each.step(actions[:NUM_ENVS])
        buffer.record(each)
    assert (len(buffer), buffer.unfinished_steps()) == (NUM_ENVS, 1)
    spy.reset(seed=0)
    spy.step(actions[:NUM_ENVS])
    assert stored(buffer) == spy.happened


def test_other_environments_are_refused(envs):
    buffer = fetch_env.HerBuffer(envs, 100)
    single = fetch_env.FetchEnv("FetchReach-v4")
    theirs = gymnasium.make_vec(
        "fetch_env/FetchReach-v4", num_envs=NUM_ENVS, vectorization_mode="sync"
    )
    for other in (single, theirs, "FetchReach-v4", None):
        with pytest.raises(
            TypeError, match=f"FetchVectorEnv can be recorded, and not {type(other).__name__}"
        ):
            buffer.record(other)
    with pytest.raises(TypeError, match="Halved may change"):
        buffer.record(Halved("FetchReach-v4", NUM_ENVS))
    envs.step = print
    with pytest.raises(TypeError, match="FetchVectorEnv may change"):
        buffer.record(envs)
